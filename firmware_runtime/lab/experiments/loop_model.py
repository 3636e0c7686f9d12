"""A ramp that is sent out and back: ramp -> echo -> probe, cut off at the echo.

Source: Pecker Marcosig, Giribet, Castro: DEVS-over-ROS (DoveR), Winter Simulation Conference 2018,
Figures 12 and 13: a ramp from a source in the simulator, sent back by a node of its own.
"""

from collections.abc import Mapping
from typing import Final

from msgspec import structs
from msgspec.structs import replace

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.board.roles import ROBOT
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND, seconds

ROLES: Final[Mapping[str, tuple[str, ...]]] = {ROBOT: ("echo",)}
SENT, ECHOED, BACK = "ramp.value", "echo.back", "probe.back"
"""The ports whose messages are the three instants of one round."""


class Ramp(Atomic):
    """Sends how many seconds it has run, once a period: a ramp of one a second.

    sending (period) --value!--> sending
    """

    def __init__(self, name: str, period: int) -> None:
        super().__init__(name)
        self.value = self.out_port("value", float)
        self.period = period
        self._at = 0

    def initialize(self) -> None:
        """Send the first value after a period."""
        self._at = self.period
        self.hold_in("sending", self.period)

    def output(self) -> None:
        """Send the ramp."""
        self.value.send(self._at / SECOND)

    def internal(self) -> None:
        """Go on."""
        self._at += self.period
        self.hold_in("sending", self.period)


class Echo(Atomic):
    """Answers every value with the value, at the same instant.

    waiting --value?--> sending (0) --back!--> waiting
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.value = self.in_port("value", float)
        self.back = self.out_port("back", float)
        self._kept: list[float] = []

    def output(self) -> None:
        """Send back what came, in order."""
        for each in self._kept:
            self.back.send(each)

    def internal(self) -> None:
        """Wait for the next."""
        self._kept = []
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- it answers at once
        """Keep all that came."""
        self._kept = [*self._kept, *self.value]
        self.activate("sending")


class Loop(Coupled):
    """The ramp, whatever sends it back, and an echo that notes when it arrives again."""

    def __init__(self, period: int) -> None:
        super().__init__("loop")
        ramp = self.add(Ramp("ramp", period))
        echo, probe = self.add(Echo("echo")), self.add(Echo("probe"))
        self.couple(ramp.value, echo.value)
        self.couple(echo.back, probe.value)
        self.probe = probe


def loop_board(board: Board, period_s: float) -> Board:
    """A board with the loop in place of its model, and all its other settings; it has no chips."""
    settings = structs.replace(
        board.settings,
        roles=ROLES,
        buses={},
        ports={},
        output_enable=None,
        overruns={},
        deadlines=(),
    )

    def build(_lines: Lines) -> Robot:
        return Robot(model=Loop(seconds(period_s)), probe=(), stop=())

    return replace(
        board, settings=settings, build=build, devices=(), loads={}, ports={}, retunable=()
    )


def loop_end(end: BoardEnd) -> BoardEnd:
    """One end of the loop: the echo stands where a robot has its hardware, and is spoken to."""
    return replace(end, has_hardware=end.role == ROBOT)
