"""What is on a wire between two events: a polynomial in time that starts at its event."""

from math import isfinite
from numbers import Real
from typing import Final, NamedTuple

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import NEVER, SECOND

NANO: Final = 1e-9
"""Seconds in a nanosecond."""

LONGEST_S: Final = NEVER / SECOND - 1.0
"""From here on a duration counts as NEVER."""


class Segment(NamedTuple):
    """`value + slope t + half_curvature t^2 + sixth_jerk t^3`, t in seconds since it was sent.

    The units are the signal's, and the signal's by s, s2 and s3. QSS1 sends constants, QSS2 and
    LIQSS2 straight lines, QSS3 parabolas; `sixth_jerk` is set on the wire `state` of a QSS3 only.
    """

    value: float
    slope: float = 0.0
    half_curvature: float = 0.0
    sixth_jerk: float = 0.0

    def at(self, seconds: float) -> float:
        """The value so many seconds after the start."""
        a, b, c, d = self
        return a + seconds * (b + seconds * (c + seconds * d))

    def after(self, seconds: float) -> "Segment":
        """The same polynomial, begun so many seconds later."""
        a, b, c, d = self
        return Segment(
            a + seconds * (b + seconds * (c + seconds * d)),
            b + seconds * (2.0 * c + 3.0 * seconds * d),
            c + 3.0 * seconds * d,
            d,
        )


ZERO_SEGMENT: Final = Segment(0.0)


def whole_after(seconds: float) -> int:
    """The whole ns that span a duration, 1 at least unless it is none; NEVER without an end.

    A duration that is a whole number of ns but for the rounding of a float is that number.
    """
    if seconds >= LONGEST_S:
        return NEVER
    if seconds <= 0.0:
        return 0
    ns = seconds * 1e9
    nearest = round(ns)
    if abs(ns - nearest) <= 1e-14 * ns + 1e-6:
        return max(nearest, 1)
    return int(ns) + 1


def next_instant(now: int, seconds: float) -> int:
    """The instant, in ns, a duration later, 1 ns at least; NEVER without an end."""
    after = max(whole_after(seconds), 1)
    return NEVER if after >= NEVER else now + after


def is_finite(value: object) -> bool:
    """Whether it is a real number that a float can hold."""
    try:
        return isinstance(value, Real) and isfinite(value)
    except OverflowError:
        return False


def demand_finite(block: str, **numbers: object) -> None:
    """Refuse what is no finite number of a block: in one, it would spoil all that is downstream."""
    for name, value in numbers.items():
        if not is_finite(value):
            raise ModelError(f"{name} is {value!r}", where=block, expected="a finite number")
