"""Eight propeller motors in four opposing pairs: duties in, four forces out.

A motor's effective duty s follows ds/dt = (duty - s)/lag, its thrust is `pair_thrust_n * s^2`, and
a pair pushes with the difference of its two. So a differential pair about one half, 0.5 + u/2 and
0.5 - u/2, settles at exactly `pair_thrust_n * u`.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

from sim_doubles.worlds.swing import Transient

__all__ = ["MOTORS", "PropellerPairs", "Terms"]

MOTORS = 8

Terms: TypeAlias = tuple[float, float, float]
"""A transient without its decay: settled, single, double."""

_ANY_DECAY = 1.0
"""Motors without lag have no transient, so how fast it would die out is immaterial."""


class PropellerPairs:
    """Four pairs; pair i has the motors 2i, which pushes, and 2i + 1, which pushes back.

    All stand still at first. `lag_s` = 0 means that a motor follows its duty at once. Forces are in
    N and body axes, from now on for as long as the duties hold: each motor's thrust is
    k*(duty + gap*p)^2 with the gap between its speed and its duty, here multiplied out.
    """

    def __init__(self, pair_thrust_n: float, lag_s: float) -> None:
        self._thrust_n = pair_thrust_n
        self._lags = lag_s > 0.0
        self.decay = 1.0 / lag_s if self._lags else _ANY_DECAY
        """Rate at which every force settles, in 1/s."""
        self._speeds: Sequence[float] = (0.0,) * MOTORS
        self._duties: Sequence[float] = ()
        self._settled_turn = 0.0
        self._only_turns = False
        """Each pair turns as much as the others, with a lag: what one does is known of all."""
        self.hold((0.0,) * MOTORS)

    @property
    def duties(self) -> Sequence[float]:
        """Return the motors' duties now."""
        return self._duties

    def hold(self, duties: Sequence[float]) -> None:
        """Drive the motors with these duties from now on."""
        if duties == self._duties:
            return
        self._duties = held = tuple(duties)
        d1, b1, d2, b2, d3, b3, d4, b4 = held
        k = self._thrust_n
        self._settled_turn = (
            k * (d1 * d1 - b1 * b1)
            - k * (d2 * d2 - b2 * b2)
            + k * (d3 * d3 - b3 * b3)
            - k * (d4 * d4 - b4 * b4)
        )
        self._only_turns = (
            self._lags and _only_turns(held) and (self._only_turns or _only_turns(self._speeds))
        )

    def forward(self) -> Transient:
        """The force along x."""
        return self._pair(0) - self._pair(2)

    def left(self) -> Transient:
        """The force along y."""
        return self._pair(3) - self._pair(1)

    def turning(self, leverage: float) -> Transient:
        """The force that turns the body from x to y on the lever arm, times a factor."""
        single, double = self._gaps()
        return Transient(
            self._settled_turn * leverage, single * leverage, double * leverage, self.decay
        )

    def turn_for(self, leverage: float, elapsed_s: float) -> Terms:
        """The same as numbers, for `elapsed_s` from now on, which then have passed.

        To the bit the same, and sooner, where all pairs only turn: four equal terms add up exactly.
        """
        settled = self._settled_turn * leverage
        if not self._only_turns:
            single, double = self._gaps()
            self.advance(elapsed_s)
            return settled, single * leverage, double * leverage
        duties, speeds, k = self._duties, self._speeds, self._thrust_n
        d, b = duties[0], duties[1]
        s, r = speeds[0] - d, speeds[1] - b
        single = 8.0 * k * (d * s - b * r)
        double = 4.0 * k * (s * s - r * r)
        p = math.exp(-self.decay * elapsed_s)
        s, r = d + s * p, b + r * p
        self._speeds = (s, r, r, s, s, r, r, s)
        return settled, single * leverage, double * leverage

    def advance(self, elapsed_s: float) -> None:
        """Let `elapsed_s` pass with the duties held."""
        p = math.exp(-self.decay * elapsed_s)
        d1, b1, d2, b2, d3, b3, d4, b4 = self._duties
        s1, r1, s2, r2, s3, r3, s4, r4 = self._speeds
        self._speeds = (
            d1 + (s1 - d1) * p,
            b1 + (r1 - b1) * p,
            d2 + (s2 - d2) * p,
            b2 + (r2 - b2) * p,
            d3 + (s3 - d3) * p,
            b3 + (r3 - b3) * p,
            d4 + (s4 - d4) * p,
            b4 + (r4 - b4) * p,
        )

    def _gaps(self) -> tuple[float, float]:
        """Single and double of the turning force, written out: a plant works them out often."""
        d1, b1, d2, b2, d3, b3, d4, b4 = self._duties
        s1, r1, s2, r2, s3, r3, s4, r4 = self._speeds if self._lags else self._duties
        s1, r1, s2, r2 = s1 - d1, r1 - b1, s2 - d2, r2 - b2
        s3, r3, s4, r4 = s3 - d3, r3 - b3, s4 - d4, r4 - b4
        k = self._thrust_n
        twice = 2.0 * k
        return (
            twice * (d1 * s1 - b1 * r1)
            - twice * (d2 * s2 - b2 * r2)
            + twice * (d3 * s3 - b3 * r3)
            - twice * (d4 * s4 - b4 * r4),
            k * (s1 * s1 - r1 * r1)
            - k * (s2 * s2 - r2 * r2)
            + k * (s3 * s3 - r3 * r3)
            - k * (s4 * s4 - r4 * r4),
        )

    def _pair(self, index: int) -> Transient:
        """The force of one pair."""
        thrust_n, forth = self._thrust_n, 2 * index
        speeds = self._speeds if self._lags else self._duties
        duty, back_duty = self._duties[forth : forth + 2]
        gap, back_gap = speeds[forth] - duty, speeds[forth + 1] - back_duty
        return Transient(
            thrust_n * (duty * duty - back_duty * back_duty),
            2.0 * thrust_n * (duty * gap - back_duty * back_gap),
            thrust_n * (gap * gap - back_gap * back_gap),
            self.decay,
        )


def _only_turns(motors: Sequence[float]) -> bool:
    """Return whether the pairs push alike, the second and the fourth the other way round."""
    d, b = motors[0], motors[1]
    return motors == (d, b, b, d, d, b, b, d)
