"""LIQSS2: linearly implicit QSS2, for stiff systems.

The state's own part in its derivative is taken as linear, x' = a q + b, with `a` from how the
derivative answered the last change of q. The new q is the straight line that touches the parabola
of x, computed with that very q, at the end of the step: an implicit step of second order without
iteration. With n = a (a x + b) + b', which is x'' if q were x, the line begins

    (h^2 / 2) |n| / (1 - a h + (a h)^2 / 2)

beside x. The step h is the one for which that is half the quantum; where there is none, x is so
close to its equilibrium that q becomes the equilibrium, and no step follows at all. The other half
of the quantum is left for what the others do meanwhile, so that |x - q| <= quantum always.

Source of the method: Migoni, Bortolotto, Kofman and Cellier, "Linearly Implicit Quantization-Based
Integration Methods for Stiff Ordinary Differential Equations", Simulation Modelling Practice and
Theory 35, 2013. The closed form of the step is derived here.
"""

from math import sqrt
from typing import ClassVar, Final

from firmware_runtime.devs.errors import ModelError
from firmware_runtime.models.qss.qss2 import QSS2
from firmware_runtime.models.qss.roots import leaves_band
from firmware_runtime.models.qss.segment import NANO, Segment

_SHORT_STEPS: Final = 1000
"""So many steps of 1 ns on end are a livelock."""


class LIQSS2(QSS2):
    """Second order, implicit: a fast stable state does not force its step upon the system."""

    _is_explicit: ClassVar[bool] = False

    def __init__(
        self, name: str, initial: float, quantum: float, *, relative_quantum: float = 0.0
    ) -> None:
        super().__init__(name, initial, quantum, relative_quantum=relative_quantum)
        self._a = 0.0
        """Of the derivative by the own q, in 1/s; never above 0."""
        self._change = 0.0
        """By how much the last own event moved q, while its answer is awaited.

        The answer comes at the same instant. Without one the derivative does not read q, and an `a`
        above from a change of something else, as at an event, is none.
        """
        self._short = 0
        self._may_correct = self._corrects = False

    def _quantized_after(self, seconds: float) -> Segment:
        q0, q1 = self._line(seconds)
        return Segment(q0, q1)

    def internal(self) -> None:
        """Let q be the line that meets x at the step's end, or go on after an announcement."""
        self._at += self.sigma
        seconds = self.sigma * NANO
        if not self._requantizes:
            self._advance(seconds)
            self._plan_quantized(self._leaves())
            return
        q0, q1 = self._line(seconds)
        self._a = self._slope_after(seconds)
        self._advance(seconds)
        self._change, self._may_correct = q0 - self._q0, not self._corrects
        self._corrects = False
        self._q0, self._q1 = q0, q1
        self._width = self._quantum_at(self._x)
        self.steps += 1
        self._announces = self._restarts = False
        self.sigma = max(self._whole(self._leaves()), 1)
        self._short = self._short + 1 if self.sigma == 1 else 0
        if self._short >= _SHORT_STEPS:
            raise ModelError(
                f"{self.path}: {_SHORT_STEPS} steps of 1 ns on end with a quantum of "
                f"{self._width:.3g}; expected longer ones: choose a larger quantum"
            )

    def external(self, elapsed: int) -> None:
        """Take the new derivative, or be reset."""
        self._at += elapsed
        self._a = self._slope_after(elapsed * NANO)
        self._advance(elapsed * NANO)
        if self.derivative:
            segment = self.derivative[-1]
            if segment[2] != 0.0:
                self._refuse_degree()
            if elapsed == 0 and abs(self._change) > 0.1 * self._width:
                self._a = min((segment[0] - self._u0) / self._change, 0.0)
            self._u0, self._u1 = segment[0], segment[1]
        self._change = 0.0
        if self.reset:
            self._restart(self.reset[-1][0])
        elif elapsed == 0 and self._may_correct and self.derivative:
            self._correct()
        self._may_correct = False
        self._plan(self._leaves())

    def _correct(self) -> None:
        """Let q be renewed once more if it holds much longer with what the answer has taught."""
        if self._a == 0.0: return
        q0, q1 = self._line(0.0)
        u0, u1 = self._u0 + self._a * (q0 - self._q0), self._u1 + self._a * (q1 - self._q1)
        longer = _leaves(self._x - q0, u0 - q1, 0.5 * u1, self._width)
        if longer > 4.0 * self._leaves():
            self._restarts = self._corrects = True

    def _slope_after(self, seconds: float) -> float:
        """`a`, or nothing if so many seconds have brought no answer to a change of q."""
        unanswered = seconds > 0.0 and abs(self._change) > 0.1 * self._width
        return 0.0 if unanswered else self._a

    def _advance(self, seconds: float) -> None:
        u0, u1 = self._u0, self._u1
        self._x += seconds * (u0 + 0.5 * u1 * seconds)
        self._u0 = u0 + u1 * seconds
        self._q0 += seconds * self._q1

    def _line(self, seconds: float) -> tuple[float, float]:
        """Value and slope of the q to be sent so many seconds after the last transition."""
        a, u1 = self._slope_after(seconds), self._u1
        x = self._x + seconds * (self._u0 + 0.5 * u1 * seconds)
        if self.steps == 0:
            return x, 0.0
        u0 = self._u0 + u1 * seconds
        q0 = self._q0 + seconds * self._q1
        b0, b1 = u0 - a * q0, u1 - a * self._q1
        curving = a * (a * x + b0) + b1
        if curving == 0.0:
            return x, a * x + b0
        half = 0.5 * self._quantum_at(x)
        excess = abs(curving) - half * a * a
        if excess <= 0.0:
            return -(b0 + b1 / a) / a, -b1 / a
        root = sqrt(max(2.0 * half * abs(curving) - (half * a) ** 2, 0.0))
        step = (root - half * a) / excess
        beside = half if curving > 0.0 else -half
        slope = (a * (x - beside) + b0 + b1 * step) / (1.0 - a * step)
        return x - beside, slope

    def _leaves(self) -> float:
        """When q has to be renewed: where it meets x, or at the edge of the quantum."""
        return _leaves(
            self._x - self._q0, self._u0 - self._q1, 0.5 * self._u1, self._width
        )


def _leaves(c0: float, c1: float, c2: float, width: float) -> float:
    edge = leaves_band(c0, c1, c2, width)
    if c0 * c2 > 0.0 > c1 * c2 and c1 * c1 > 0.4 * abs(c2) * width:
        nearest = -c1 / (2.0 * c2)
        return min(nearest, edge)
    return edge
