"""Conditions of an expression: on which side of zero they are, and for how long surely; roots.

A root is where a polynomial of degree three at most first leaves a band, or its side of zero. Roots
of lines and parabolas are exact to the rounding of a float. A cubic is cut at its extrema into
stretches on which it is monotone; in the first that holds a root, Newton's steps are kept within
the bracket.
"""

from collections.abc import Callable, Sequence
from math import cbrt, inf, sqrt
from typing import ClassVar, Final

from firmware_runtime.models.qss.program import Condition, Program
from firmware_runtime.models.qss.segment import LONGEST_S, NANO

_STEPS = 60
_CLOSE = 1e-13
"""Newton's last step, as a share of the root; the error is about its square."""


def leaves_band(band: float, c0: float, c1: float, c2: float = 0.0, c3: float = 0.0) -> float:
    """The first t >= 0 with `|c0 + c1 t + c2 t^2 + c3 t^3| >= band`, or infinity."""
    if abs(c0) >= band:
        return 0.0
    if c3 == 0.0 and c2 != 0.0:  # opened upwards, it leaves below before it turns, or above
        if c2 < 0.0:
            c0, c1, c2 = -c0, -c1, -c2
        within = c1 * c1 - 4.0 * c2 * (c0 + band)
        if c1 < 0.0 <= within:
            return 2.0 * (c0 + band) / (sqrt(within) - c1)
        root = sqrt(c1 * c1 - 4.0 * c2 * (c0 - band))
        return 2.0 * (band - c0) / (c1 + root) if c1 >= 0.0 else (root - c1) / (2.0 * c2)
    up = down = inf
    if c1 > 0.0 or c2 > 0.0 or c3 > 0.0:
        up = falls_below_zero(band - c0, -c1, -c2, -c3)
    if c1 < 0.0 or c2 < 0.0 or c3 < 0.0:
        down = falls_below_zero(band + c0, c1, c2, c3)
    return min(down, up)


def falls_below_zero(c0: float, c1: float, c2: float = 0.0, c3: float = 0.0) -> float:
    """The first t >= 0 at which the polynomial goes from positive to negative, or infinity.

    0 if it is negative and falling; one that is negative and rising has to come up first, or to
    turn: of a ball that its event has sent up from just below the floor, too slow to reach it.
    """
    if c0 <= 0.0 and _first_sign(c1, c2, c3) < 0:
        return 0.0
    if c3 != 0.0:
        return _cubic_falls(c0, c1, c2, c3)
    if c2 == 0.0:
        return -c0 / c1 if c1 < 0.0 else inf
    within = c1 * c1 - 4.0 * c2 * c0
    if within <= 0.0:
        return -0.5 * c1 / c2 if c0 < 0.0 < c1 and c2 < 0.0 else inf
    root = sqrt(within)
    if c2 > 0.0:  # falls at the smaller root
        when = 2.0 * c0 / (root - c1) if c1 < 0.0 else -inf
    else:  # at the larger one
        when = -2.0 * c0 / (c1 - root) if c1 <= 0.0 else (-c1 - root) / (2.0 * c2)
    return when if when > 0.0 else inf


def _first_sign(*coefficients: float) -> int:
    for each in coefficients:
        if each != 0.0:
            return 1 if each > 0.0 else -1
    return 0


def _cubic_falls(c0: float, c1: float, c2: float, c3: float) -> float:
    begin, before = 0.0, c0
    for end in _extrema(c1, c2, c3):
        value = c0 + end * (c1 + end * (c2 + end * c3))
        if before >= 0.0 > value:
            return _bracketed(c0, c1, c2, c3, begin, end)
        if begin == 0.0 and value < 0.0:  # it came up from below zero, and turns
            return end
        begin, before = end, value
    if c3 > 0.0 or before < 0.0:
        return inf
    return _bracketed(c0, c1, c2, c3, begin, _beyond(c0, c1, c2, c3, begin))


def _extrema(c1: float, c2: float, c3: float) -> tuple[float, ...]:
    """The positive instants at which the cubic's slope changes its sign, ascending."""
    within = c2 * c2 - 3.0 * c1 * c3
    if within <= 0.0:
        return ()
    q = -(c2 + sqrt(within)) if c2 >= 0.0 else sqrt(within) - c2
    first, second = q / (3.0 * c3), c1 / q
    if first > second:
        first, second = second, first
    if first > 0.0:
        return (first, second)
    return (second,) if second > 0.0 else ()


def _beyond(c0: float, c1: float, c2: float, c3: float, begin: float) -> float:
    """An instant by which the cubic has the sign of `c3` for good (Fujiwara's bound)."""
    farthest = 2.0 * max(abs(c2 / c3), sqrt(abs(c1 / c3)), cbrt(abs(c0 / c3)))
    return max(farthest, begin) * 1.000001


def _bracketed(  # noqa: PLR0913, PLR0917 -- four coefficients and two ends
    c0: float, c1: float, c2: float, c3: float, begin: float, end: float
) -> float:
    """The root between two instants at which the values differ in sign; monotone in between."""
    # above zero where it begins, or at it, and below where it ends
    t = 0.5 * (begin + end)
    for _ in range(_STEPS):
        value = c0 + t * (c1 + t * (c2 + t * c3))
        if value > 0.0:
            begin = t
        else:
            end = t
        slope = c1 + t * (2.0 * c2 + t * 3.0 * c3)
        following = t - value / slope if slope != 0.0 else inf
        if abs(following - t) <= _CLOSE * t:
            return following
        t = following if begin < following < end else 0.5 * (begin + end)
    return t


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
