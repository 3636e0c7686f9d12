"""QSS3: the quantized state is a parabola between events, the state a cubic.

Source: Kofman, "A Third Order Discrete Event Simulation Method for Continuous System Simulation",
Latin American Applied Research 36(2), 2006.
"""

from math import cbrt, inf
from typing import ClassVar

from firmware_runtime.models.qss.integrator import Integrator
from firmware_runtime.models.qss.roots import leaves_band_cubic
from firmware_runtime.models.qss.segment import NANO, Segment


class QSS3(Integrator):
    """Third order: steps grow with the cube root of the quantum."""

    order: ClassVar[int] = 3

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name, initial, quantum, relative_quantum=relative_quantum)
        self._u = Segment(0.0)
        self._q = Segment(self._x)

    def segment_after(self, seconds: float) -> Segment:
        """The polynomial of x from so many seconds after the last transition on."""
        u0, u1, u2, _ = self._u
        value = self._x + seconds * (u0 + seconds * (0.5 * u1 + seconds * u2 / 3.0))
        slope = u0 + seconds * (u1 + seconds * u2)
        return Segment(value, slope, 0.5 * u1 + seconds * u2, u2 / 3.0)

    def _quantized_after(self, seconds: float) -> Segment:
        return self.segment_after(seconds)._replace(sixth_jerk=0.0)

    def internal(self) -> None:
        """Let q be the osculating parabola of x, or go on after an announcement."""
        self._at += self.sigma
        self._advance(self.sigma * NANO)
        u0, u1, u2, _ = self._u
        if not self._requantizes:
            self._plan_quantized(self._leaves())
            return
        self._q = Segment(self._x, u0, 0.5 * u1)
        self._width = self._quantum_at(self._x)
        self.steps += 1
        self._plan_step(cbrt(3.0 * self._width / abs(u2)) if u2 != 0.0 else inf)

    def external(self, elapsed: int) -> None:
        """Take the new derivative, or be reset."""
        self._at += elapsed
        seconds = elapsed * NANO
        self._advance(seconds)
        q0, q1, q2, _ = self._q
        self._q = Segment(q0 + seconds * (q1 + seconds * q2), q1 + 2.0 * seconds * q2, q2)
        if self.derivative:
            self._u = segment = self.derivative[-1]
            if segment[3] != 0.0:
                self._refuse_degree()
        if self.reset:
            self._restart(self.reset[-1][0])
        self._plan(self._leaves())

    def _advance(self, seconds: float) -> None:
        u0, u1, u2, _ = self._u
        self._x += seconds * (u0 + seconds * (0.5 * u1 + seconds * u2 / 3.0))
        self._u = Segment(u0 + seconds * (u1 + seconds * u2), u1 + 2.0 * seconds * u2, u2)

    def _leaves(self) -> float:
        q0, q1, q2, _ = self._q
        u0, u1, u2, _ = self._u
        return leaves_band_cubic(self._x - q0, u0 - q1, 0.5 * u1 - q2, u2 / 3.0, self._width)
