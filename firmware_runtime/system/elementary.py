"""Elementary functions with the same bits on every machine: sin, cos, atan2, hypot, exp, expm1.

A C library's are within one unit in the last place, but which neighbour they give depends on the
library's version and on the processor: with and without fused multiply-add glibc 2.36 on x86-64
differs in each of them. These use +, -, *, /, square root and comparisons only, one after another,
each of which IEEE 754 defines to the bit, and whole numbers. They are within 2.5 units in the last
place of the true value for angles up to 1e6 rad, `expm1` within 4.

How it works. The argument is brought near zero by a multiple of pi/2 or log 2 that is kept in two
or three parts, of which the leading ones have so few bits that their product is exact; for atan2 by
the nearest eighth, whose arc tangent is in a table. There a Taylor series of few terms is enough.
"""

import math
from typing import Final

_QUADRANTS: Final = 0.6366197723675814
"""2/pi."""
_QUADRANT: Final = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
"""pi/2 in three parts, of 33, 33 and 53 bits."""
_FAR: Final = 1e6
"""From here on an angle is brought back by whole turns of `math.tau` first."""
_LOG_2: Final = (0.6931471803691238, 1.9082149292705877e-10)
"""In two parts, of 32 and 53 bits."""
_HALVINGS: Final = 1.4426950408889634
"""1/log 2."""
_LEAST, _MOST = -745.2, 709.8
"""Beyond these e^x is zero or too large."""
_ARC_TANGENTS: Final = (
    0.0,
    0.12435499454676144,
    0.24497866312686414,
    0.35877067027057225,
    0.4636476090008061,
    0.5585993153435624,
    0.6435011087932844,
    0.7188299996216245,
    0.7853981633974483,
)
"""Of 0, 1/8, ... 1."""


def sin(x: float) -> float:
    """Sine of an angle in rad. Raises ValueError for an infinite one."""
    if not -_FAR < x < _FAR:
        x = math.remainder(x, math.tau)
        if x != x:  # noqa: PLR0124 -- not a number
            return x
    quadrant, x = _reduced(x)
    value = _cosine(x) if quadrant & 1 else _sine(x)
    return -value if quadrant & 2 else value


def cos(x: float) -> float:
    """Cosine of an angle in rad. Raises ValueError for an infinite one."""
    if not -_FAR < x < _FAR:
        x = math.remainder(x, math.tau)
        if x != x:  # noqa: PLR0124 -- not a number
            return x
    quadrant, x = _reduced(x)
    value = _sine(x) if quadrant & 1 else _cosine(x)
    return -value if (quadrant + 1) & 2 else value


def cos_sin(x: float) -> tuple[float, float]:
    """Cosine and sine of an angle in rad: those of `cos` and `sin`, in less time."""
    if not -_FAR < x < _FAR:
        return cos(x), sin(x)
    quadrant, x = _reduced(x)
    cosine, sine = _cosine(x), _sine(x)
    if quadrant & 1:
        cosine, sine = -sine, cosine
    return (-cosine, -sine) if quadrant & 2 else (cosine, sine)


def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) in rad, from -pi to pi."""
    across, along = abs(y), abs(x)
    if not (0.0 < across < math.inf and 0.0 < along < math.inf):
        return math.atan2(y, x)  # zeros, infinities, NaN: constants
    is_steep = across > along
    ratio = along / across if is_steep else across / along
    eighths = round(8.0 * ratio)
    near = eighths * 0.125
    u = (ratio - near) / (1.0 + near * ratio)
    z = u * u
    series = 1 / 3 - z * (1 / 5 - z * (1 / 7 - z * (1 / 9 - z * (1 / 11 - z * (1 / 13)))))
    angle = _ARC_TANGENTS[eighths] + (u - u * z * series)
    if is_steep:
        angle = math.pi / 2 - angle
    if x < 0.0:
        angle = math.pi - angle
    return angle if y > 0.0 else -angle


def hypot(x: float, y: float) -> float:
    """Length of the vector (x, y)."""
    square = x * x + y * y
    if 1e-280 < square < math.inf:
        return math.sqrt(square)
    larger = max(abs(x), abs(y))
    if not 0.0 < larger < math.inf:
        return math.hypot(x, y)  # zeros, infinities, NaN
    x, y = x / larger, y / larger
    return larger * math.sqrt(x * x + y * y)


def exp(x: float) -> float:
    """The power of e to the x. Raises OverflowError for more than a float holds."""
    if not _LEAST < x < _MOST:
        return math.exp(x)  # 0, infinity, NaN, OverflowError
    twos, x = _halved(x)
    return math.ldexp(1.0 + (x + x * x * _exponential(x)), twos)


def expm1(x: float) -> float:
    """The power of e to the x, less 1. Raises OverflowError for more than a float holds."""
    if not -0.35 < x < 0.35:
        return exp(x) - 1.0
    return x + x * x * _exponential(x)


def _reduced(x: float) -> tuple[int, float]:
    """The nearest multiple of pi/2, and what is left of an angle below `_FAR`."""
    quadrant = round(x * _QUADRANTS)
    if not quadrant:
        return 0, x
    first, second, third = _QUADRANT
    return quadrant, ((x - quadrant * first) - quadrant * second) - quadrant * third


def _sine(x: float) -> float:
    """Return it for an angle within pi/4."""
    z = x * x
    series = 1 / 362880 - z * (1 / 39916800 - z * (1 / 6227020800 - z * (1 / 1307674368000)))
    return x - x * z * (1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * series)))


def _cosine(x: float) -> float:
    """Return it for an angle within pi/4."""
    z = x * x
    series = 1 / 3628800 - z * (1 / 479001600 - z * (1 / 87178291200 - z * (1 / 20922789888000)))
    return 1.0 - (0.5 * z - z * z * (1 / 24 - z * (1 / 720 - z * (1 / 40320 - z * series))))


def _halved(x: float) -> tuple[int, float]:
    """The nearest multiple of log 2, and what is left."""
    twos = round(x * _HALVINGS) if not -0.35 < x < 0.35 else 0
    first, second = _LOG_2
    return twos, (x - twos * first) - twos * second


def _exponential(x: float) -> float:
    """(e^x - 1 - x) / x^2 for x within half of log 2."""
    series = 1 / 3628800 + x * (1 / 39916800 + x * (1 / 479001600 + x * (1 / 6227020800)))
    series = 1 / 5040 + x * (1 / 40320 + x * (1 / 362880 + x * series))
    return 1 / 2 + x * (1 / 6 + x * (1 / 24 + x * (1 / 120 + x * (1 / 720 + x * series))))
