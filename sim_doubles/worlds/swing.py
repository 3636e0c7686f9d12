"""The exact turning of a body under a transient drive and viscous damping.

    d(rate)/dt = drive(t) - damping * rate,    d(yaw)/dt = rate

The drive is a constant and two decaying exponentials, so the rate is a sum of convolutions of two
exponentials each, and yaw of their integrals. Written as divided differences they stay accurate
where two exponents meet, undamped bodies included.

Transients settle exponentially, in closed form. While its command holds, a motor with first-order
lag turns at `duty + gap*p`, where p = e^(-decay*t) falls from 1 to 0. Thrust goes with the square,
so every force and every moment summed from such motors is a quadratic in p, and the instant at
which it passes a level is a root of that quadratic.
"""

import math
from functools import lru_cache
from typing import NamedTuple

_ROUNDING = 1e-14
"""A value that starts on the level may be rounded to a crossing that is already past."""


class Transient:
    """The quantity `settled + single*p + double*p^2` with `p = e^(-decay*t)`.

    `decay` is in 1/s and positive; t is in seconds from now. Transients that are added or
    subtracted share one decay.
    """

    __slots__ = ("decay", "double", "settled", "single")

    def __init__(self, settled: float, single: float, double: float, decay: float) -> None:
        self.settled = settled
        self.single = single
        self.double = double
        self.decay = decay

    def __add__(self, other: "Transient") -> "Transient":
        return Transient(
            self.settled + other.settled,
            self.single + other.single,
            self.double + other.double,
            self.decay,
        )

    def __sub__(self, other: "Transient") -> "Transient":
        return Transient(
            self.settled - other.settled,
            self.single - other.single,
            self.double - other.double,
            self.decay,
        )

    def __mul__(self, factor: float) -> "Transient":
        return Transient(
            self.settled * factor, self.single * factor, self.double * factor, self.decay
        )

    def less(self, constant: float) -> "Transient":
        """The same quantity, `constant` lower."""
        return Transient(self.settled - constant, self.single, self.double, self.decay)

    def now(self) -> float:
        """The value at t = 0."""
        return self.settled + self.single + self.double

    def at(self, elapsed: float) -> float:
        """The value `elapsed` seconds from now."""
        p = math.exp(-self.decay * elapsed)
        return self.settled + p * (self.single + p * self.double)

    def after(self, elapsed: float) -> "Transient":
        """The same quantity with t counted from `elapsed` seconds later."""
        p = math.exp(-self.decay * elapsed)
        return Transient(self.settled, self.single * p, self.double * p * p, self.decay)

    def crossings(self, level: float) -> list[float]:
        """The instants after now at which the value is `level`, ascending: none, one or two."""
        return sorted(-math.log(p) / self.decay for p in self._roots(level) if 0.0 < p < 1.0)

    def exceeds(self, level: float) -> float:
        """Return when the value first goes above `level`: 0 if above now, infinity if never."""
        if self.now() > level:
            return 0.0
        for p in self._roots(level):
            falling_with_p = self.single + 2.0 * self.double * p < 0.0
            if falling_with_p and 0.0 < p < 1.0 + _ROUNDING:
                return -math.log(min(p, 1.0)) / self.decay
        return math.inf

    def _roots(self, level: float) -> list[float]:
        return _quadratic_roots(self.double, self.single, self.settled - level)


def _quadratic_roots(a: float, b: float, c: float) -> list[float]:
    """The real roots of a*p^2 + b*p + c, without the cancellation of the school formula."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return []
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    roots = []
    if a != 0.0:
        roots.append(q / a)
    if q != 0.0:
        roots.append(c / q)
    return roots


_INSTANT_S = 1e-13
"""Times closer than this are one instant."""


class Swing:
    """One uninterrupted turn from a yaw in rad and a rate in rad/s; times in s from its start.

    `drive` is the moment over the inertia, in rad/s2; `damping` the viscous friction over it, in
    1/s.
    """

    __slots__ = ("_damping", "_drive", "_rate", "_yaw")

    def __init__(self, yaw: float, rate: float, drive: Transient, damping: float) -> None:
        self._yaw = yaw
        self._rate = rate
        self._drive = drive
        self._damping = damping

    def rate(self, t: float) -> float:
        """Return the yaw rate at `t`."""
        return self._turned(_course(self._damping, self._drive.decay, t))[1]

    def yaw(self, t: float) -> float:
        """Return the yaw at `t`."""
        return self._turned(_course(self._damping, self._drive.decay, t))[0]

    def state(self, t: float) -> tuple[float, float]:
        """Return yaw and rate at `t`: for less than both alone, and least for a `t` that recurs."""
        return self._turned(recurring_course(self._damping, self._drive.decay, t))

    def _turned(self, course: "Course") -> tuple[float, float]:
        drive = self._drive
        return turned(self._yaw, self._rate, (drive.settled, drive.single, drive.double), course)

    def first_stop(self, direction: int, until: float) -> float | None:
        """Return when a body turning in `direction` comes to rest, at most `until`, or None.

        Between two sign changes of the drive rate*e^(damping*t) is monotone, so the rate passes
        zero at most once there and the signs at the ends show it.
        """
        begin = 0.0
        turns = self._drive.crossings(0.0)
        for end in (*(t for t in turns if _INSTANT_S < t < until), until):
            if direction * self.rate(end) < 0.0:
                return self._bisect(direction, begin, end)
            begin = end
        return None

    def _bisect(self, direction: int, before: float, after: float) -> float:
        tolerance = _INSTANT_S + 1e-15 * after  # never below what a float resolves
        while after - before > tolerance:
            middle = 0.5 * (before + after)
            if direction * self.rate(middle) < 0.0:
                after = middle
            else:
                before = middle
        return after


class Course(NamedTuple):
    """Factors of a turn that follow from its time alone: those of its rate, then of its yaw."""

    decayed: float
    coast: float
    single: float
    double: float
    ramp: float
    single_yaw: float
    double_yaw: float


def _course(damping: float, decay: float, t: float) -> Course:
    """Convolutions of the damping with nothing and the drive's exponentials, and their integrals.

    `coast` is in both: the rate follows it by the settled drive, yaw by the rate at the start.
    """
    coast = _convolution(damping, 0.0, t)
    single = _convolution(damping, decay, t)
    double = _convolution(damping, 2.0 * decay, t)
    return Course(
        math.exp(-damping * t),
        coast,
        single,
        double,
        _ramp(damping, t),
        (coast - single) / decay,
        (coast - double) / (2.0 * decay),
    )


recurring_course = lru_cache(maxsize=256)(_course)
"""A plant that is read on a schedule moves by the same few spans of time again and again."""


def turned(
    yaw: float, rate: float, drive: tuple[float, float, float], course: Course
) -> tuple[float, float]:
    """Yaw and rate after a turn from these, driven by a transient's settled, single and double."""
    settled, once, twice = drive
    decayed, coast, single, double, ramp, single_yaw, double_yaw = course
    return (
        yaw + rate * coast + settled * ramp + once * single_yaw + twice * double_yaw,
        rate * decayed + settled * coast + once * single + twice * double,
    )


def _convolution(a: float, b: float, t: float) -> float:
    """The integral of e^(-a*(t - u)) * e^(-b*u) over u from 0 to t; a, b >= 0, equal or not."""
    apart = abs(a - b) * t
    mean = -math.expm1(-apart) / apart if apart else 1.0
    return t * mean * math.exp(-min(a, b) * t)


def _ramp(damping: float, t: float) -> float:
    """The integral of (1 - e^(-damping*u))/damping over u from 0 to t; t^2/2 without damping."""
    z = damping * t
    if z < 1e-3:
        return t * t * (1.0 / 2.0 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z / 120.0)))
    return (t - _convolution(damping, 0.0, t)) / damping
