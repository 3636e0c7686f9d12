"""Eight propeller motors in four opposing pairs: duties in, four forces out.

A motor's effective duty s follows ds/dt = (duty - s)/lag, its thrust is `pair_thrust_n * s^2`, and
a pair pushes with the difference of its two. So a differential pair about one half, 0.5 + u/2 and
0.5 - u/2, settles at exactly `pair_thrust_n * u`.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sim_doubles.worlds.transient import Transient

__all__ = ["MOTORS", "PairForces", "PropellerPairs"]

MOTORS = 8

_ANY_DECAY = 1.0
"""Motors without lag have no transient, so how fast it would die out is immaterial."""


class PairForces(NamedTuple):
    """The forces of the four pairs in N, and what they sum to in body axes."""

    f1: Transient
    f2: Transient
    f3: Transient
    f4: Transient

    def forward(self) -> Transient:
        """The force along x."""
        return self.f1 - self.f3

    def left(self) -> Transient:
        """The force along y."""
        return self.f4 - self.f2

    def turning(self) -> Transient:
        """The force that turns the body from x to y when it acts on the lever arm."""
        f1, f2, f3, f4 = self
        return Transient(
            f1.settled - f2.settled + f3.settled - f4.settled,
            f1.single - f2.single + f3.single - f4.single,
            f1.double - f2.double + f3.double - f4.double,
            f1.decay,
        )


class PropellerPairs:
    """Four pairs; pair i has the motors 2i, which pushes, and 2i + 1, which pushes back.

    All stand still at first. `lag_s` = 0 means that a motor follows its duty at once.
    """

    def __init__(self, pair_thrust_n: float, lag_s: float) -> None:
        self._thrust_n = pair_thrust_n
        self._lags = lag_s > 0.0
        self._decay = 1.0 / lag_s if self._lags else _ANY_DECAY
        self._speeds: Sequence[float] = (0.0,) * MOTORS

    def forces(self, duties: Sequence[float]) -> PairForces:
        """The forces from now on, as long as the duties hold."""
        speeds, pair = self._speeds if self._lags else duties, self._pair
        return PairForces(
            pair(duties[0], speeds[0], duties[1], speeds[1]),
            pair(duties[2], speeds[2], duties[3], speeds[3]),
            pair(duties[4], speeds[4], duties[5], speeds[5]),
            pair(duties[6], speeds[6], duties[7], speeds[7]),
        )

    def advance(self, duties: Sequence[float], elapsed_s: float) -> None:
        """Let `elapsed_s` pass with these duties."""
        p = math.exp(-self._decay * elapsed_s)
        self._speeds = [
            duty + (speed - duty) * p for duty, speed in zip(duties, self._speeds, strict=True)
        ]

    def _pair(self, duty: float, speed: float, back_duty: float, back_speed: float) -> Transient:
        """Each motor's thrust is k*(duty + gap*p)^2, here multiplied out."""
        thrust_n, gap, back_gap = self._thrust_n, speed - duty, back_speed - back_duty
        return Transient(
            thrust_n * (duty * duty - back_duty * back_duty),
            2.0 * thrust_n * (duty * gap - back_duty * back_gap),
            thrust_n * (gap * gap - back_gap * back_gap),
            self._decay,
        )
