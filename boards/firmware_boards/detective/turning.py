"""Command and response: how treads or head are commanded to turn, against how a compass turns.

Treads slip, and how much is not known; a head stands at its end stops. So the comparison is wide,
and finds what is neither: a heading that stands still under a turn, or turns the other way, far too
little or too fast, or that turns under treads that go straight.
"""

import math
from abc import abstractmethod
from typing import Final, NamedTuple

from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE

from firmware_boards.detective.settings import TurnCheckTable
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.models.cross_check import (
    CrossCheck,
    CrossCheckSettings,
    Source,
    Standstill,
    Window,
)
from firmware_runtime.models.motion import Applied

CIRCLE_DEG: Final = 360.0
STANDS_DEG: Final = 3.0
"""Less than this is no turn, by two compasses in whole degrees."""
TELLS_DEG: Final = 5.0
"""From a turn of so much on, as it is commanded, headings tell whether it stands."""
NEAR_DEG: Final = 10.0
"""So far from an end stop, by two compasses, a head may be at it; its two may be 20 apart."""
SENSES: Final = {CLOCKWISE: 1, COUNTERCLOCKWISE: -1}
"""Sense of a motor, a tread's forward positive, by signal; any other signal stops it."""
TREADS: Final = "turn (degrees, compass less treads' command)"
COURSE: Final = "turn from its course (degrees, compass less where it set out)"
HEAD: Final = "turn of the head (degrees, compass less motor's command)"
"""What is compared, for the fault."""


class Turn(NamedTuple):
    """A turn that motors are commanded to, at the instant of a heading."""

    rate_deg_s: float
    """To the left, as headings grow."""
    heading_deg: float


class CommandedTurn(Atomic):
    """Joins commands that motors apply with headings, while they are to move what a compass is on.

    waiting --heading?, commanded to move or so at the heading before--> joining (0) --turn!-->
    waiting

    A move begins and ends with a rate of 0; between two of them nothing is said, and the heading
    may change as it likes. `full_deg_s` is the rate at the speed that its motors are told.
    """

    def __init__(self, name: str, full_deg_s: float) -> None:
        super().__init__(name)
        self.applied = self.in_port("applied", Applied)
        self.heading = self.in_port("heading", float)
        self.turn_out = self.out_port("turn", Turn)
        self.full_deg_s = full_deg_s
        self.turn = Turn(0.0, 0.0)
        self._is_applied = self._did_move = False

    @abstractmethod
    def take_commands(self) -> None:
        """Read the ports of the motors."""

    @abstractmethod
    def share(self) -> float:
        """Return the part of the full rate that is commanded, to the left; 0 for no turn."""

    @property
    def moves(self) -> bool:
        """Whether they are commanded to move it; one that turns is."""
        return self.share() != 0.0

    def output(self) -> None:
        """Send the turn."""
        self.turn_out.send(self.turn)

    def internal(self) -> None:
        """Wait for the next heading."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take commands, and what becomes of them; join them with a heading."""
        self.take_commands()
        if self.applied:
            self._is_applied = self.applied[-1] is not Applied.NOTHING
        if self.heading and self._joins(self.heading[-1]):
            self.activate("joining")
        else:
            self.continue_(elapsed)

    def _joins(self, heading_deg: float) -> bool:
        """Return whether there is something to send."""
        did_move, self._did_move = self._did_move, self._is_applied and self.moves
        is_amid = did_move and self._did_move
        self.turn = Turn(self.full_deg_s * self.share() if is_amid else 0.0, heading_deg)
        return did_move or self._did_move


class VehicleTurn(CommandedTurn):
    """Two treads, `right` and `left`, that turn a vehicle by going against each other."""

    def __init__(self, name: str, full_deg_s: float) -> None:
        super().__init__(name, full_deg_s)
        self.right = self.in_port("right", int)
        self.left = self.in_port("left", int)
        self._right = self._left = 0

    def take_commands(self) -> None:
        """Keep the newest signal of each tread."""
        if self.right:
            self._right = SENSES.get(self.right[-1], 0)
        if self.left:
            self._left = SENSES.get(self.left[-1], 0)

    def share(self) -> float:
        """Return half of what the right one is told more than the left one."""
        return (self._right - self._left) / 2


class StraightCourse(VehicleTurn):
    """The same treads, told to go the same way: how far it has turned since it set out.

    Where one of them does nothing it turns, and so it does by a push. `from_start` finds both of
    treads that tell nothing of themselves. Others find theirs by their encoders, and what looks for
    its target bears to be turned; from its first turn on it only drives there, and would miss it.
    """

    def __init__(self, name: str, *, from_start: bool) -> None:
        super().__init__(name, full_deg_s=0.0)
        self._is_set = from_start
        self._set_out_deg = 0.0

    def take_commands(self) -> None:
        """The same, with whether it has turned."""
        super().take_commands()
        self._is_set |= self._right == -self._left != 0  # one may be told before the other

    @property
    def moves(self) -> bool:
        """Whether it is told to go straight, where that counts."""
        return self._is_set and self._right == self._left != 0

    def _joins(self, heading_deg: float) -> bool:
        """The same, of the heading less that at which it set out."""
        if not self._did_move:
            self._set_out_deg = heading_deg
        return super()._joins(math.remainder(heading_deg - self._set_out_deg, CIRCLE_DEG))


class HeadTurn(CommandedTurn):
    """A motor, `motor`, that turns a head to and fro between two end stops.

    `body` tells the heading of what carries it: said is the head's from there, and nothing before.

    Where it begins is not known: the run before it may have ended anywhere. So it may be at an end
    stop from the start, or sooner than it turns back, as may one that was stopped amid a sweep:
    until it turns back nothing is expected of it while it stands, after that it stands at a stop
    for `at_stop` ns at most. Where `stop_deg` tells how far from straight ahead its stops are, it
    may stand near the stop that it turns towards only.
    """

    def __init__(
        self, name: str, full_deg_s: float, stop_deg: float | None = None, at_stop: int = 0
    ) -> None:
        super().__init__(name, full_deg_s)
        self.motor = self.in_port("motor", int)
        self.body = self.in_port("body", float)
        self.stop_deg = stop_deg
        self.at_stop = at_stop
        self._sense = 0
        self._may_stand = self._stands = True
        self._stood_for = 0
        self._seen_deg: float | None = None
        self._told_from_deg: float | None = None
        """The heading by which it was last told whether it stands."""
        self._turned_for = 0
        """Ns since then for which its motor has turned it."""
        self._body_deg: float | None = None

    def external(self, elapsed: int) -> None:
        """The same, with how long it stands."""
        self._stood_for += elapsed
        if self._is_applied and self._sense != 0:
            self._turned_for += elapsed
        super().external(elapsed)

    def take_commands(self) -> None:
        """Keep the newest signal, and whether the head has turned back since it was stopped."""
        if self.body:
            self._body_deg = self.body[-1]
        if not self.motor:
            return
        before, self._sense = self._sense, SENSES.get(self.motor[-1], 0)
        if before not in {0, self._sense}:
            self._may_stand = self._sense == 0

    def share(self) -> float:
        """Return the sense: clockwise is to the right."""
        return 0.0 if self._stands and self._is_at_a_stop else -float(self._sense)

    @property
    def _is_at_a_stop(self) -> bool:
        """Whether a head that stands may do so because of a stop."""
        if self.stop_deg is None or self._seen_deg is None:
            return self._may_stand
        beside_deg = math.remainder(self._seen_deg + self._sense * self.stop_deg, CIRCLE_DEG)
        is_near = abs(beside_deg) <= NEAR_DEG
        return is_near and (self._may_stand or self._stood_for <= self.at_stop)

    def _joins(self, heading_deg: float) -> bool:
        """The same, with whether it stands."""
        if self._body_deg is None:
            return False
        ahead_deg = (heading_deg - self._body_deg) % CIRCLE_DEG
        self._seen_deg = ahead_deg
        self._tell_whether_it_stands(ahead_deg)
        return super()._joins(ahead_deg)

    def _tell_whether_it_stands(self, ahead_deg: float) -> None:
        """By this heading, once it has turned, or had time to turn by enough since another one."""
        if self._told_from_deg is None:
            self._told_from_deg, self._turned_for = ahead_deg, 0
        stands = abs(math.remainder(ahead_deg - self._told_from_deg, CIRCLE_DEG)) < STANDS_DEG
        due_deg = self.full_deg_s * self._turned_for / SECOND
        if stands and self._sense != 0 and due_deg < TELLS_DEG:
            return
        self._stands = stands
        self._told_from_deg, self._turned_for = ahead_deg, 0
        if not stands:
            self._stood_for = 0


def turn_check(name: str, quantity: str, stated: TurnCheckTable) -> CrossCheck[Turn, Turn]:
    """A compass against the motors that turn it: either may do nothing, or the contrary."""
    return CrossCheck(
        name,
        CrossCheckSettings(
            quantity=quantity,
            windows=(Window(seconds(stated.window_s), stated.tolerance_deg),),
            share=stated.share,
            standstill=Standstill(stated.still_within_deg, stated.still_turn_deg),
            circle=CIRCLE_DEG,
        ),
        rate=Source(Turn, lambda turn: turn.rate_deg_s),
        value=Source(Turn, lambda turn: turn.heading_deg),
    )
