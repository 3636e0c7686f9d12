"""CircuitPython's `digitalio` for a machine without pins: a line that keeps its level.

A line belongs to its name: every `DigitalInOut` of one pin sees the same level, so that a test can
play the other side.
"""

from enum import Enum

from firmware_runtime.hal.circuitpython.released import Released

_levels: dict[object, bool] = {}


class Direction(Enum):
    """Direction of a line."""

    INPUT = "input"
    OUTPUT = "output"


class Pull(Enum):
    """The resistor at an input."""

    UP = "up"
    DOWN = "down"


class DriveMode(Enum):
    """Drive mode of an output."""

    PUSH_PULL = "push-pull"
    OPEN_DRAIN = "open-drain"


class DigitalInOut(Released):
    """One line; an input from construction on."""

    def __init__(self, pin: object) -> None:
        self._pin = pin
        self.direction = Direction.INPUT
        self.drive_mode = DriveMode.PUSH_PULL
        self.pull: Pull | None = None

    def switch_to_output(
        self,
        value: bool = False,  # noqa: FBT001, FBT002 -- CircuitPython's signature
        drive_mode: DriveMode = DriveMode.PUSH_PULL,
    ) -> None:
        """Drive the line."""
        self.direction, self.drive_mode = Direction.OUTPUT, drive_mode
        self.value = value

    def switch_to_input(self, pull: Pull | None = None) -> None:
        """Let the line go; what holds it then is the pull, where nothing else has set it."""
        self.direction, self.pull = Direction.INPUT, pull
        _levels.setdefault(self._pin, pull is Pull.UP)

    @property
    def value(self) -> bool:
        """The level of the line."""
        return _levels.get(self._pin, False)

    @value.setter
    def value(self, level: bool) -> None:
        _levels[self._pin] = bool(level)

    def deinit(self) -> None:
        """Let the line go."""
        self.direction = Direction.INPUT
