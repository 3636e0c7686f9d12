"""The conditions of an expression: on which side of zero they are, and for how long surely."""

from collections.abc import Callable, Sequence
from math import inf
from typing import ClassVar, Final

from firmware_runtime.models.qss.program import Condition, Program
from firmware_runtime.models.qss.roots import falls_below_zero
from firmware_runtime.models.qss.segment import LONGEST_S, NANO

FIRST_SPAN_S: Final = 1.0
INSTANT_S: Final = 2e-9
"""A value that is, or was, zero within this time is at zero: events come at whole ns."""
_MOMENT_S: Final = 2.5e-9
"""Longer than that, and no whole ns: where a value that touches zero has turned back."""


def side_of(condition: Condition, g: Sequence[float]) -> bool:
    """On which side the condition's value is; of one at zero, where it is a moment later."""
    value, slope = g[0], g[1]
    if abs(value) > INSTANT_S * abs(slope):
        return value > 0.0
    later = 0.0
    for each in reversed(g):
        later = later * _MOMENT_S + each
    return later > 0.0 if later != 0.0 else condition.at_zero


class Watch:
    """Conditions of signals: their sides, and for how long none of them can change.

    `spans` holds for each over how long a stretch it is bounded next: a guess, from the last time.
    The side of the last one is its owner's matter if `has_own`.
    """

    kept: ClassVar = ("sides", "spans")
    """The attributes that change."""

    def __init__(self, conditions: Sequence[Condition], *, has_own: bool = False) -> None:
        self.conditions = tuple(conditions)
        self._settled = tuple(enumerate(conditions))[: -1 if has_own else None]
        self.sides = [False] * len(conditions)
        self.spans = [FIRST_SPAN_S] * len(conditions)

    def settle(self, t: float, flat: Sequence[float]) -> float:
        """Bring the sides up to date, inner ones first; for how many seconds they hold."""
        leaves = inf
        for number, condition in self._settled:
            g = condition.code(t, self.sides, flat)
            side = self.sides[number] = side_of(condition, g)
            leaves = min(leaves, self.clear_for(number, t, flat, g, side=side))
        return leaves

    def clear_for(
        self, number: int, t: float, flat: Sequence[float], g: Sequence[float], *, side: bool
    ) -> float:
        """For how many seconds a condition's value surely stays on its side, if the others do.

        Up to its root where it is a cubic. Else the cubic that begins as it does, less all that the
        higher powers may take from it within some stretch of time, is below it there: up to the
        root of that, or the end of the stretch. The nearer the root, the less they take.
        """
        sign = 1.0 if side else -1.0
        a, b, c, d = sign * g[0], sign * g[1], sign * g[2], sign * g[3]
        bound = self.conditions[number].bound
        fourth, fifth = abs(g[4]), abs(g[5])
        if bound is None and fourth == fifth == 0.0:
            return falls_below_zero(a, b, c, d)
        sides = self.sides
        if bound is not None and b == c == d == 0.0 and bound(t, sides, flat, LONGEST_S) == 0.0:
            return inf

        def safe(span: float) -> float:
            most = bound(t, sides, flat, span) if bound else fourth + fifth * span
            if a > span * (abs(b) + span * (abs(c) + span * (abs(d) + most * span))):
                return span
            return falls_below_zero(a, b, c, d - most * span) if most < inf else 0.0

        def enough() -> float:
            return falls_below_zero(a, b, c, d)

        clear, self.spans[number] = furthest(self.spans[number], safe, enough)
        return max(clear, NANO)


def furthest(
    span: float, safe: Callable[[float], float], enough: Callable[[], float]
) -> tuple[float, float]:
    """For how long something is safe, and over which stretch to begin the search next time.

    `safe` says for how much of a stretch it is, by bounds over all of it: the shorter the stretch,
    the longer, until it is all of it. Half of the best, or of `enough`, will do.
    """
    first, longest = span, 0.0
    while True:
        found = safe(span)
        if found >= span:
            return max(span, longest), 4.0 * span
        longest = max(longest, found)
        if longest >= 0.5 * span or span <= NANO or longest >= 0.5 * enough():
            return longest, max(2.0 * longest, 0.25 * first)
        span = max(2.0 * found, span / 16.0, NANO)


def worth(program: Program, t: float, flat: Sequence[float]) -> float:
    """The value at an instant, with the sides as they are then."""
    sides: list[bool] = []
    for condition in program.conditions:
        sides.append(side_of(condition, condition.code(t, sides, flat)))
    return program.value(t, sides, flat)[0]
