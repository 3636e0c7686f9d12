"""QSS1: the quantized state is constant between events, the state a straight line.

Source: Kofman and Junco, "Quantized State Systems: A DEVS Approach for Continuous System
Simulation", Transactions of SCS 18(3), 2001.
"""

from typing import ClassVar

from firmware_runtime.models.qss.integrator import Integrator
from firmware_runtime.models.qss.roots import leaves_band
from firmware_runtime.models.qss.segment import NANO, Segment


class QSS1(Integrator):
    """First order: a step lasts quantum / |x'|; twice the accuracy takes twice the steps."""

    order: ClassVar[int] = 1

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name, initial, quantum, relative_quantum=relative_quantum)
        self._u = 0.0
        self._q = self._x

    def segment_after(self, seconds: float) -> Segment:
        """The polynomial of x from so many seconds after the last transition on."""
        return Segment(self._x + seconds * self._u, self._u)

    def _quantized_after(self, seconds: float) -> Segment:
        return Segment(self._x + seconds * self._u)

    def internal(self) -> None:
        """Let q be x, or go on after an announcement."""
        self._at += self.sigma
        u = self._u
        x = self._x = self._x + self.sigma * NANO * u
        if not self._requantizes:
            self._plan_quantized(leaves_band(x - self._q, u, 0.0, self._width))
            return
        self._q = x
        self._width = self._quantum_at(x)
        self.steps += 1
        self._plan_step(leaves_band(0.0, u, 0.0, self._width))

    def external(self, elapsed: int) -> None:
        """Take the new derivative, or be reset."""
        self._at += elapsed
        self._x += elapsed * NANO * self._u
        if self.derivative:
            segment = self.derivative[-1]
            self._u = segment[0]
            if segment[1] != 0.0:
                self._refuse_degree()
        if self.reset:
            self._restart(self.reset[-1][0])
        self._plan(leaves_band(self._x - self._q, self._u, 0.0, self._width))
