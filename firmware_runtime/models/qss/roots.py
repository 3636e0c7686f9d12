"""When a polynomial of degree three at most first leaves a band, or its side of zero.

Roots of lines and parabolas are exact to the rounding of a float. A cubic is cut at its extrema
into stretches on which it is monotone; in the first that holds a root, Newton's steps are kept
within the bracket.
"""

from math import cbrt, inf, sqrt

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
    if c0 < 0.0 and (c1 < 0.0 or (c1 == 0.0 and c2 < 0.0)):
        return 0.0
    if c0 == 0.0 and _first_sign(c1, c2, c3) < 0:
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
        if begin == 0.0 and c1 > 0.0 > value:
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
    rises = c0 + end * (c1 + end * (c2 + end * c3)) > 0.0
    t = 0.5 * (begin + end)
    for _ in range(_STEPS):
        value = c0 + t * (c1 + t * (c2 + t * c3))
        if (value > 0.0) is rises:
            end = t
        else:
            begin = t
        slope = c1 + t * (2.0 * c2 + t * 3.0 * c3)
        following = t - value / slope if slope != 0.0 else inf
        if abs(following - t) <= _CLOSE * t:
            return following
        t = following if begin < following < end else 0.5 * (begin + end)
    return t
