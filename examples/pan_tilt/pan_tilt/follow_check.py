"""Whether the head comes nearer to its light: a servo tells nothing back, but the eyes see it."""

from typing import Final

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import Fault, Implausible
from firmware_runtime.models.motion import Applied, Motion

FAR: Final = 0.1
"""Difference of two photocells, -1 to 1, that a head which follows has soon made smaller; then it
is 0.061 at most, while its light moves as in board.toml."""
NEARER: Final = 0.01
"""So much less is nearer."""
PATIENCE: Final = 200 * MILLISECOND
"""Ns in which a head far from its light has come nearer; one that follows needs a few readings."""


GIVES_UP: Final = 10
"""Reports in a row, with no moment near the light, after which it is let go."""


class FollowCheck(Atomic):
    """Reports an axis that is far from its light, is told to turn there, and comes no nearer.

    watching --difference? far--> doubting (PATIENCE) --fault!--> doubting
    doubting, for the tenth time in a row --fault!, ended!--> doubting
    doubting, of one reading alone --> watching
    doubting --difference? nearer--> doubting, for PATIENCE again
    doubting --difference? near, follow? 0--> watching

    Nothing is expected of an axis that is disarmed, or at the end of its way, by the last `effect`;
    but one that came to its end without coming nearer does not turn as it is told. Nothing is said
    of one reading alone: amid it a light may have gone out. A light that goes out while the head is
    far from it, runs away faster than that turns, or is found beyond the end, is reported, too.
    What is reported ten times in a row, for 2 s, ends the run: eyes that lie, or an axis that does
    not turn, lead nowhere.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.difference = self.in_port("difference", Motion)
        self.follow = self.in_port("follow", int)
        self.effect = self.in_port("effect", Applied)
        self.fault = self.out_port("fault", Fault)
        self.ended = self.out_port("ended", Ending)
        self.is_following = False
        self.applied = Applied.NOTHING
        self.far = self.nearest = 0.0
        """How far it is, and was when it came nearer last."""
        self._doubted_for = self._reports = 0
        self._is_seen_again = False
        """Whether a second reading has shown the difference, too."""

    def initialize(self) -> None:
        """Watch."""
        self.passivate("watching")

    def output(self) -> None:
        """Report."""
        if not self._is_seen_again:
            return
        expected = f"nearer than {self.nearest:.3g} in {PATIENCE // MILLISECOND} ms"
        error = Implausible(self.path, "difference to the light", self.far, expected)
        self.fault.send(Fault.of(error, self._reports + 1))
        if self._reports + 1 == GIVES_UP:
            self.ended.send(Ending(str(error), failed=True))

    def internal(self) -> None:
        """Doubt on."""
        if not self._is_seen_again:
            self._watch()
            return
        self._reports += 1
        self._doubt()

    def external(self, elapsed: int) -> None:
        """Take in what came."""
        self._doubted_for += elapsed
        if self.follow:
            self.is_following = self.follow[-1] == 1
        if self.effect:
            self.applied = self.effect[-1]
        if not self.is_following:
            self._watch()
        elif self.difference:
            self._compare(abs(self.difference[-1].position))
        else:
            self.continue_(elapsed)

    def _compare(self, far: float) -> None:
        self.far = far
        is_new = self.phase == "watching"
        self._is_seen_again = not is_new
        has_to_turn = self.applied is Applied.ALL or (self.applied is Applied.PART and not is_new)
        if far <= FAR or not has_to_turn:
            self._watch()
        elif is_new or far < self.nearest - NEARER:
            self._doubt()
        else:
            self.hold_in("doubting", max(0, PATIENCE - self._doubted_for))

    def _watch(self) -> None:
        self._reports = 0
        self.passivate("watching")

    def _doubt(self) -> None:
        self.nearest, self._doubted_for = self.far, 0
        self.hold_in("doubting", PATIENCE)
