"""Command and response: how the treads are commanded to turn, against how the compass turns.

Treads slip, and how much is not known. So the comparison is wide, and finds what is no slip: a
heading that stands still under a turn, or turns the other way, or far too little or too fast.
"""

from typing import Final, NamedTuple

from firmware_drivers.motors import CLOCKWISE, COUNTERCLOCKWISE

from firmware_boards.detective.settings import TurnCheckTable
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.cross_check import (
    CrossCheck,
    CrossCheckSettings,
    Source,
    Standstill,
    Window,
)
from firmware_runtime.models.motion import Applied

CIRCLE_DEG: Final = 360.0
SENSES: Final = {CLOCKWISE: 1, COUNTERCLOCKWISE: -1}
"""Sense of a tread, forward positive, by signal; any other signal stops it."""


class Turn(NamedTuple):
    """A turn that the treads are commanded to, at the instant of a heading."""

    rate_deg_s: float
    """To the left, as headings grow."""
    heading_deg: float


class CommandedTurn(Atomic):
    """Joins commands that the treads apply with headings, while they are to turn the vehicle.

    waiting --heading?, commanded to turn or so at the heading before--> joining (0) --turn!-->
    waiting

    A turn begins and ends with a rate of 0; between two turns nothing is said, and the heading may
    change as it likes. `rate_deg_s` is that of both treads against each other.
    """

    def __init__(self, name: str, rate_deg_s: float) -> None:
        super().__init__(name)
        self.right = self.in_port("right", int)
        self.left = self.in_port("left", int)
        self.applied = self.in_port("applied", Applied)
        self.heading = self.in_port("heading", float)
        self.turn_out = self.out_port("turn", Turn)
        self.rate_deg_s = rate_deg_s
        self.turn = Turn(0.0, 0.0)
        self._right = self._left = 0
        self._is_applied = self._did_turn = False

    def output(self) -> None:
        """Send the turn."""
        self.turn_out.send(self.turn)

    def internal(self) -> None:
        """Wait for the next heading."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take commands, and what becomes of them; join them with a heading."""
        if self.right:
            self._right = SENSES.get(self.right[-1], 0)
        if self.left:
            self._left = SENSES.get(self.left[-1], 0)
        if self.applied:
            self._is_applied = self.applied[-1] is not Applied.NOTHING
        if self.heading and self._joins(self.heading[-1]):
            self.activate("joining")
        else:
            self.continue_(elapsed)

    def _joins(self, heading_deg: float) -> bool:
        """Return whether there is something to send."""
        rate = self.rate_deg_s * (self._right - self._left) / 2 if self._is_applied else 0.0
        did_turn, self._did_turn = self._did_turn, rate != 0.0
        self.turn = Turn(rate if did_turn else 0.0, heading_deg)
        return did_turn or self._did_turn


def turn_check(stated: TurnCheckTable) -> CrossCheck[Turn, Turn]:
    """The compass of the body against the treads: either may do nothing, or the contrary."""
    return CrossCheck(
        "turn_check",
        CrossCheckSettings(
            quantity="turn (degrees, compass less treads' command)",
            windows=(Window(seconds(stated.window_s), stated.tolerance_deg),),
            share=stated.share,
            standstill=Standstill(stated.still_within_deg, stated.still_turn_deg),
            circle=CIRCLE_DEG,
        ),
        rate=Source(Turn, lambda turn: turn.rate_deg_s),
        value=Source(Turn, lambda turn: turn.heading_deg),
    )
