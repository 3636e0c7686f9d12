"""The exact turning of a body under a transient drive and viscous damping.

    d(rate)/dt = drive(t) - damping * rate,    d(yaw)/dt = rate

The drive is a constant and two decaying exponentials, so the rate is a sum of convolutions of two
exponentials each, and yaw of their integrals. Written as divided differences they stay accurate
where two exponents meet, undamped bodies included.
"""

import math

from sim_doubles.worlds.transient import Transient

__all__ = ["Swing"]

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
        """The yaw rate at `t`."""
        return self._rate_of(t, *self._convolutions(t))

    def yaw(self, t: float) -> float:
        """The yaw at `t`."""
        return self._yaw_of(t, *self._convolutions(t))

    def state(self, t: float) -> tuple[float, float]:
        """Yaw and rate at `t`, for less than both alone."""
        convolutions = self._convolutions(t)
        return self._yaw_of(t, *convolutions), self._rate_of(t, *convolutions)

    def _convolutions(self, t: float) -> tuple[float, float, float]:
        """Of the damping with nothing, and with the drive's two exponentials."""
        damping, decay = self._damping, self._drive.decay
        return (
            _convolution(damping, 0.0, t),
            _convolution(damping, decay, t),
            _convolution(damping, 2.0 * decay, t),
        )

    def _rate_of(self, t: float, coast: float, single: float, double: float) -> float:
        drive = self._drive
        return (
            self._rate * math.exp(-self._damping * t)
            + drive.settled * coast
            + drive.single * single
            + drive.double * double
        )

    def _yaw_of(self, t: float, coast: float, single: float, double: float) -> float:
        """The rate, integrated term by term."""
        drive = self._drive
        return (
            self._yaw
            + self._rate * coast
            + drive.settled * _ramp(self._damping, t)
            + drive.single * ((coast - single) / drive.decay)
            + drive.double * ((coast - double) / (2.0 * drive.decay))
        )

    def first_stop(self, direction: int, until: float) -> float | None:
        """When a body turning in `direction` comes to rest, at most `until`, or None.

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
