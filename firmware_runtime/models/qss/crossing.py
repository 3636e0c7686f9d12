"""Zero-crossing detection: the instant at which an expression of signals changes its sign."""

import ast
from collections.abc import Sequence
from typing import ClassVar, Final, Literal

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.models.qss.program import compile_condition
from firmware_runtime.models.qss.segment import NANO, Readings, next_instant
from firmware_runtime.models.qss.watch import Watch, side_of

__all__ = ["Crossing", "Direction"]

Direction = Literal["rising", "falling", "both"]

_LEAST_GAP: Final = 10
_MOST_LEAST: Final = 1000
"""So many events in a row, each within so many ns of the last, accumulate."""


class Crossing:
    """The side of zero on which an expression is, and when it changes: an event of a direction.

    The instant is the root of the polynomial, rounded up to whole ns, so that the crossing has
    happened. Events that come ever closer accumulate (Zeno): a ModelError.
    Where an event is answered at its own instant by a change that leads back, as of a ball that
    bounces, the value has touched zero and not passed it: that is no second event.
    Nor is it one where a value that its event has set to rest at zero, as of a body that sticks,
    leaves it. `at_zero` says whether one that stands there otherwise is above. One that is zero at
    the start, and may stand there for long, has not crossed yet: where it goes then, by its first
    derivative that is not zero, is an event of that direction; of both directions it starts above.
    With `happens_at_start` one that is above at the start has its event then.
    """

    kept: ClassVar = (
        *("side", "beyond", "beyond_at", "has_turned", "returns", "rests", "is_poised"),
        *("last", "hurried"),
    )
    """The attributes that change."""

    def __init__(
        self,
        readings: Readings,
        tree: ast.expr,
        *,
        direction: Direction = "rising",
        at_zero: bool = True,
        happens_at_start: bool = False,
    ) -> None:
        self.readings, self.direction = readings, direction
        self._happens_at_start = happens_at_start
        conditions = compile_condition(tree, readings.layout, at_zero=at_zero)
        self.watch, self._difference = Watch(conditions, has_own=True), conditions[-1]
        self.side: bool | None = None
        self.beyond, self.beyond_at = 0.0, -1
        """How far past zero it was at its last event, and when that was."""
        self.has_turned = self.returns = self.rests = False
        self.is_poised = False
        """Whether it has been zero ever since the start."""
        self.last = [-NEVER, -NEVER]
        """The instants of its last fall and rise, and how many came at once after the last."""
        self.hurried = [0, 0]

    def look(self, now: int) -> tuple[bool, int]:
        """Return whether its event happens now, and at which instant to look next."""
        t, flat = now * NANO, self.readings.at(now)
        try:
            leaves = self.watch.settle(t, flat)
            g = self._difference.code(t, self.watch.sides, flat)
        except (ValueError, ArithmeticError) as error:
            raise self.readings.no_value(now, error) from error
        was, self.has_turned = self.side, False
        if was is None:
            self.is_poised = g[0] == 0.0
        side = self._side_at_start(g) if self.is_poised else side_of(self._difference, g)
        if was is not None and not self.is_poised:
            side = self._side_as_led(now, g, side, was=was)
        leaves = min(leaves, self.watch.clear_for(-1, t, flat, g, side=side))
        if self.is_poised:
            leaves = max(leaves, NANO)
        self.side = side
        due = next_instant(now, leaves)
        if was is None:
            is_at_once = self.is_poised and g[1] != 0.0
            return side and self._happens_at_start, now if is_at_once else due
        if side is was or self.has_turned:
            return False, due
        self._note_event(now, rises=side)
        if self.direction not in {"both", _WORDS[side]}:
            self.beyond_at = -1
            return False, due
        self.beyond, self.beyond_at = abs(g[0]), now if any(g) else -1
        return True, due

    def _side_at_start(self, g: Sequence[float]) -> bool:
        """The side of what is zero since the start: the one from which its event is reached.

        It crosses as soon as it has a slope, else in the next nanosecond: a ball at rest on its
        floor, whose way is only bent, then has a speed that its event can turn round.
        """
        starts = self.direction != "rising"
        if self.side is None or g[0] == g[1] == 0.0:
            return starts
        self.is_poised = False
        return side_of(self._difference, g)

    def _side_as_led(self, now: int, g: Sequence[float], side: bool, *, was: bool) -> bool:  # noqa: FBT001
        """The side, but for what is left of an event: where it set the value, and its rounding."""
        is_answer = self.beyond_at == now
        if is_answer and not any(g):
            self.rests = True
        if self.rests:
            self.rests = not any(g)
            self.has_turned = not self.rests and side is not was
            return was if self.rests else side
        stays = abs(g[0]) <= 2.0 * self.beyond + NANO * abs(g[1])
        if is_answer and stays and _leads(g) is (not was):
            self.beyond_at, self.has_turned, self.returns = -1, True, True
            return not was
        if self.returns and side is not was and _leads(g) is not side:
            return was
        self.returns = False
        return side

    def _note_event(self, now: int, *, rises: bool) -> None:
        """Refuse events of one direction whose gaps shrink to nothing: time would stand still."""
        gap, self.last[rises] = now - self.last[rises], now
        self.hurried[rises] = self.hurried[rises] + 1 if gap <= _LEAST_GAP else 0
        if self.hurried[rises] >= _MOST_LEAST:
            raise ModelError(
                f"{self.readings.text} crosses zero ever faster, at {format_time(now)} "
                f"{gap} ns after the last time",
                where=self.readings.path(),
                expected="events that do not accumulate",
            )


def _leads(g: Sequence[float]) -> bool | None:
    """To which side the value moves; None while it stands."""
    return next((each > 0.0 for each in g[1:] if each != 0.0), None)


_WORDS: Final = {True: "rising", False: "falling"}
