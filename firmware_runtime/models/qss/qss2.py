"""QSS2: the quantized state is a straight line between events, the state a parabola.

Source: Kofman, "A Second-Order Approximation for DEVS Simulation of Continuous Systems",
Simulation 78(2), 2002.
"""

from typing import ClassVar

from firmware_runtime.models.qss.integrator import Integrator
from firmware_runtime.models.qss.roots import leaves_band
from firmware_runtime.models.qss.segment import NANO, Segment


class QSS2(Integrator):
    """Second order: steps grow with the square root of the quantum."""

    order: ClassVar[int] = 2

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name, initial, quantum, relative_quantum=relative_quantum)
        self._u0 = self._u1 = 0.0
        self._q0, self._q1 = self._x, 0.0

    def segment_after(self, seconds: float) -> Segment:
        """The polynomial of x from so many seconds after the last transition on."""
        u0, u1 = self._u0, self._u1
        return Segment(self._x + seconds * (u0 + 0.5 * u1 * seconds), u0 + u1 * seconds, 0.5 * u1)

    def _quantized_after(self, seconds: float) -> Segment:
        u0, u1 = self._u0, self._u1
        return Segment(self._x + seconds * (u0 + 0.5 * u1 * seconds), u0 + u1 * seconds)

    def internal(self) -> None:
        """Let q be the tangent of x, or go on after an announcement."""
        self._at += self.sigma
        seconds = self.sigma * NANO
        u0, u1 = self._u0, self._u1
        x = self._x = self._x + seconds * (u0 + 0.5 * u1 * seconds)
        u0 = self._u0 = u0 + u1 * seconds
        if not self._requantizes:
            self._q0 += seconds * self._q1
            self._plan_quantized(self._leaves())
            return
        self._q0, self._q1 = x, u0
        self._width = self._quantum_at(x)
        self.steps += 1
        self._plan_step((2.0 * self._width / abs(u1)) ** 0.5 if u1 != 0.0 else float("inf"))

    def external(self, elapsed: int) -> None:
        """Take the new derivative, or be reset."""
        self._at += elapsed
        seconds = elapsed * NANO
        u0, u1 = self._u0, self._u1
        self._x += seconds * (u0 + 0.5 * u1 * seconds)
        self._q0 += seconds * self._q1
        if self.derivative:
            segment = self.derivative[-1]
            self._u0, self._u1 = segment[0], segment[1]
            if segment[2] != 0.0:
                self._refuse_degree()
        else:
            self._u0 = u0 + u1 * seconds
        if self.reset:
            self._restart(self.reset[-1][0])
        self._plan(self._leaves())

    def _leaves(self) -> float:
        return leaves_band(self._x - self._q0, self._u0 - self._q1, 0.5 * self._u1, self._width)
