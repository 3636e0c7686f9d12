"""A quantity that settles exponentially, in closed form.

While its command holds, a motor with first-order lag turns at `duty + gap*p`, where
p = e^(-decay*t) falls from 1 to 0. Thrust goes with the square, so every force and every moment
summed from such motors is a quadratic in p, and the instant at which it passes a level is a root of
that quadratic.
"""

import math

__all__ = ["Transient"]

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
