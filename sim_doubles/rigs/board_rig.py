"""Base of rigs: buses and ports of doubles, the enable line, the state of outputs."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Protocol, cast, runtime_checkable

from firmware_runtime.board import rigs
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.settings import BusSettings, OutputEnableSettings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import PortClosed
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target

if TYPE_CHECKING:
    from sim_doubles.serial_line import SerialTarget


class DoublesRig(Rig, Protocol):
    """Rig whose buses are served, plugged in or given faults, with transactions and warnings."""

    @property
    def buses(self) -> Mapping[str, I2cBusDouble]:
        """The buses by their names."""


def rig_for(board: Board, clock: WireClock) -> DoublesRig:
    """Return the board's doubles on this clock, found by entry point. Raises ConfigError."""
    return cast("DoublesRig", rigs.rig_for(board, clock))


@runtime_checkable
class Driving(Protocol):
    """A double with outputs: what a chip moves or switches, for logs."""

    def levels(self, at: int) -> Mapping[str, float]:
        """Return how each output stands at an instant: a share of its time, or rad/s."""

    def next_change_at(self, at: int) -> int:
        """Return the first instant after `at` at which an output changes by itself; else NEVER."""


@runtime_checkable
class RunningDown(Protocol):
    """A double whose outputs are not at rest as soon as they are off, such as motors on a ramp."""

    def outputs_on(self, at: int) -> int:
        """Return how many of its outputs are driven at an instant."""


@runtime_checkable
class Sampling(Protocol):
    """A double that takes samples by itself, whether or not it is spoken to."""

    def catch_up(self) -> None:
        """Take the samples that are due by now."""


class EnableLineDouble(EnableLine):
    """A line that is held from construction on, at the OE pins of some PCA9685.

    It is pulled to disable them until it is set, and once it is free.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._chips: list[Pca9685Double] = []
        self._closed = False

    def wire(self, chip: Pca9685Double) -> None:
        """Wire one more chip to it."""
        self._chips.append(chip)
        chip.output_enabled = False

    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not."""
        if self._closed:
            raise PortClosed("the line was used after it was closed", where=self.name)
        self._let_through(enabled=enabled)

    def close(self) -> None:
        """Free the line: the resistor disables the outputs."""
        self._closed = True
        self._let_through(enabled=False)

    def _let_through(self, *, enabled: bool) -> None:
        for chip in self._chips:
            chip.output_enabled = enabled


class BoardRig:
    """Doubles on a board's lines; a rig derived from it has the chips, and the world behind them.

    Buses are as fast as the board says, and transactions take their time on `clock`. Where the
    board has an enable line, it is wired to every PCA9685.
    """

    def __init__(
        self,
        buses: Mapping[str, BusSettings],
        clock: WireClock,
        output_enable: OutputEnableSettings | None = None,
    ) -> None:
        self.now = now = clock.__call__  # as a method, which CPython calls sooner than an object
        self.buses = {
            name: I2cBusDouble(
                name,
                now,
                (),
                bus_hz=round(stated.speed_hz),
                overhead_ns=stated.overhead_ns,
                reach=clock.reach,
            )
            for name, stated in buses.items()
        }
        self.ports: dict[str, SerialPort] = {}
        self.enable = None if output_enable is None else EnableLineDouble("output_enable")
        self._driving: dict[str, Driving] = {}
        self._counts: dict[str, Callable[[int], int]] = {}
        """How many of their outputs are on."""
        self._sampling: list[Sampling] = []

    def connect(self, bus: str, *targets: Target, name: str = "") -> None:
        """Put doubles on a bus; what they drive is in logs as `NAME.OUTPUT`, if a name is given."""
        self.buses[bus].connect(*targets)
        for each in targets:
            self._take_in(each, name)
            if self.enable is not None and isinstance(each, Pca9685Double):
                self.enable.wire(each)

    def plug_in(self, port: str, target: "SerialTarget", name: str = "") -> None:
        """Put a double on a serial port; likewise."""
        from sim_doubles.serial_line import SerialLineDouble  # noqa: PLC0415 -- few boards have one

        self.ports[port] = SerialLineDouble(port, self.now, target)
        self._take_in(target, name)

    def _take_in(self, part: object, name: str) -> None:
        if isinstance(part, Sampling):
            self._sampling.append(part)
        if name and isinstance(part, Driving):
            self._driving[name] = part
            if isinstance(part, RunningDown):
                self._counts[name] = part.outputs_on
            else:
                self._counts[name] = partial(_not_zero, part)

    # What a rig does, where its board has nothing else to say

    @property
    def shown(self) -> OutPort[float] | None:
        """The port that is worth a look over time: none."""
        return None

    def attach(self, robot: Coupled) -> None:
        """Add the world's probe beside the robot's own models: there is none."""

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:  # noqa: ARG002
        """Return how a run ended by the true state of the world: there is none."""
        return {}

    def catch_up(self) -> None:
        """Let the doubles that sample by themselves take what they still have to take."""
        for part in self._sampling:
            part.catch_up()

    @property
    def outputs(self) -> dict[str, int]:
        """Return the count of outputs of each driving chip that are on."""
        at = self.now()
        return {name: count(at) for name, count in self._counts.items()}

    def levels(self, at: int) -> dict[str, float]:
        """Return how each output stands at an instant, by chip and output: `servos.3`."""
        return {
            f"{name}.{output}": level
            for name, part in self._driving.items()
            for output, level in part.levels(at).items()
        }

    def next_change_at(self, at: int) -> int:
        """Return the first instant after `at` at which an output changes by itself."""
        return min((part.next_change_at(at) for part in self._driving.values()), default=NEVER)


def _not_zero(part: Driving, at: int) -> int:
    """Return how many outputs are not 0."""
    return sum(level != 0 for level in part.levels(at).values())
