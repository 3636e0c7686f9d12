"""The quantized integration methods: what each state knows between two events, and its next step.

A quantized state knows two polynomials of time: x, the integral of its derivative, and q, one
degree less, which is what the equations see. Where x and q come to differ by the quantum, q becomes
a new polynomial; nothing happens in between. A system of such states solves the disturbed equation
x' = f(q), |q - x| <= quantum: for linear systems the error is therefore bounded at all times
(`bound`).

Sources: Cellier and Kofman, Continuous System Simulation, Springer 2006, chapters 11 and 12;
Kofman and Junco, "Quantized State Systems: A DEVS Approach for Continuous System Simulation",
Transactions of SCS 18(3), 2001 (QSS1); Kofman, "A Second-Order Approximation for DEVS Simulation of
Continuous Systems", Simulation 78(2), 2002 (QSS2); Kofman, "A Third Order Discrete Event Simulation
Method for Continuous System Simulation", Latin American Applied Research 36(2), 2006 (QSS3).
"""

from collections.abc import Callable, Sequence
from math import cbrt, inf, isfinite, sqrt
from typing import ClassVar, Final

from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.qss.roots import leaves_band, leaves_band_cubic
from firmware_runtime.models.qss.segment import LONGEST_S, NANO, Segment

RESOLUTION: Final = 2.0**-46
"""The smallest relative quantum: below it a float hardly resolves the state."""
_SHORT_STEPS: Final = 1000
"""So many steps of 1 ns on end are a livelock."""


class State:
    """One quantized state; `path` says of which model, for errors.

    The quantum, in the unit of x, is `max(quantum, relative_quantum * |x|)`. `steps` counts the
    polynomials of q. Each method returns the instant, in ns, at which q has to be renewed.
    """

    order: ClassVar[int]
    """How many coefficients q and the derivative have."""
    _is_explicit: ClassVar[bool] = True
    kept: ClassVar[tuple[str, ...]] = (
        *("at", "x", "u0", "u1", "u2", "q0", "q1", "q2", "width", "steps"),
    )
    """The attributes that change."""

    def __init__(
        self,
        path: Callable[[], str],
        initial: float,
        quantum: float,
        relative_quantum: float,
    ) -> None:
        self._path = path
        self._check(initial, quantum, relative_quantum)
        self.quantum = float(quantum)
        self.relative_quantum = max(float(relative_quantum), RESOLUTION)
        self.at = 0
        self.steps = 0
        self.x = self.q0 = float(initial)
        self.u0 = self.u1 = self.u2 = self.q1 = self.q2 = 0.0
        self.width = self._quantum_at(self.x)

    def segment_at(self, at: int) -> Segment:
        """The polynomial of x from an instant on that is not before the last event."""
        seconds = (at - self.at) * NANO
        u0, u1, u2 = self.u0, self.u1, self.u2
        return Segment(
            self.x + seconds * (u0 + seconds * (0.5 * u1 + seconds * u2 / 3.0)),
            u0 + seconds * (u1 + seconds * u2),
            0.5 * u1 + seconds * u2,
            u2 / 3.0,
        )

    def advance(self, now: int) -> None:
        """Let time pass."""
        if now == self.at:
            return
        seconds = (now - self.at) * NANO
        self.at = now
        u0, u1, u2, q2 = self.u0, self.u1, self.u2, self.q2
        if u2 == q2 == 0.0:
            self.x += seconds * (u0 + 0.5 * u1 * seconds)
            self.u0 = u0 + u1 * seconds
            self.q0 += seconds * self.q1
            return
        self.x += seconds * (u0 + seconds * (0.5 * u1 + seconds * u2 / 3.0))
        self.u0 = u0 + seconds * (u1 + seconds * u2)
        self.u1 = u1 + 2.0 * seconds * u2
        self.q0 += seconds * (self.q1 + seconds * q2)
        self.q1 += 2.0 * seconds * q2

    def requantize(self, now: int) -> int:
        """Let q begin as x does. Raises ModelError for a step that time cannot resolve."""
        self.advance(now)
        self._follow()
        self.width = self._quantum_at(self.x)
        self.steps += 1
        seconds = self._step()
        if seconds < NANO:
            raise ModelError(
                f"{self._path()}: a step of {seconds:.2g} s with a quantum of {self.width:.3g}; "
                "expected 1 ns or more: choose a larger quantum, or LIQSS2 for a stiff system"
            )
        return now + self._whole(seconds)

    def derive(self, now: int, derivative: Sequence[float]) -> int:
        """Take a new derivative.

        At the start q is renewed at once with each further coefficient that becomes known.
        """
        self.advance(now)
        self.u0 = derivative[0]
        if self.order > 1:
            self.u1 = derivative[1]
        if self.order > 2:
            self.u2 = derivative[2]
        if now == 0 and self.steps < self.order and self._is_explicit:
            return now
        return now + self._whole(self._leaves())

    def reset(self, now: int, value: float) -> int:
        """Let x be `value`; q follows at once."""
        if not isfinite(value):
            raise ModelError(f"{self._path()}: reset to {value!r}; expected a finite number")
        self.advance(now)
        self.x = value
        return now

    def _follow(self) -> None:
        self.q0 = self.x

    def _step(self) -> float:
        raise NotImplementedError

    def _leaves(self) -> float:
        c0, c1, c2 = self.x - self.q0, self.u0 - self.q1, 0.5 * self.u1 - self.q2
        return leaves_band_cubic(c0, c1, c2, self.u2 / 3.0, self.width)

    def _whole(self, seconds: float) -> int:
        """Rounded down, so that |x - q| stays within the quantum."""
        if seconds < LONGEST_S:
            return int(seconds * 1e9)
        if seconds != seconds:  # noqa: PLR0124 -- that is what NaN is
            raise ModelError(f"{self._path()}: its derivative is no number; expected a finite one")
        return NEVER

    def _quantum_at(self, value: float) -> float:
        return max(self.quantum, self.relative_quantum * abs(value))

    def _check(self, initial: float, quantum: float, relative_quantum: float) -> None:
        if not isfinite(initial):
            raise ModelError(f"{self._path()}: initial is {initial!r}; expected a finite number")
        if not (isfinite(quantum) and quantum > 0.0):
            raise ModelError(f"{self._path()}: quantum is {quantum!r}; expected a number above 0")
        if not 0.0 <= relative_quantum < 1.0:
            fault = f"relative_quantum is {relative_quantum!r}; expected 0 or more, below 1"
            raise ModelError(f"{self._path()}: {fault}")


class FirstOrder(State):
    """QSS1: q is constant, x a straight line; twice the accuracy takes twice the steps."""

    order = 1

    def _step(self) -> float:
        return self.width / abs(self.u0) if self.u0 != 0.0 else inf


class SecondOrder(State):
    """QSS2: q is a straight line, x a parabola; steps grow with the square root of the quantum."""

    order = 2

    def _follow(self) -> None:
        self.q0, self.q1 = self.x, self.u0

    def _step(self) -> float:
        return sqrt(2.0 * self.width / abs(self.u1)) if self.u1 != 0.0 else inf


class ThirdOrder(State):
    """QSS3: q is a parabola, x a cubic; steps grow with the cube root of the quantum."""

    order = 3

    def _follow(self) -> None:
        self.q0, self.q1, self.q2 = self.x, self.u0, 0.5 * self.u1

    def _step(self) -> float:
        return cbrt(3.0 * self.width / abs(self.u2)) if self.u2 != 0.0 else inf


class LinearlyImplicit(State):
    """LIQSS2, linearly implicit: a fast stable state does not force its step upon the system.

    The state's own part in its derivative is taken as linear, x' = a q + b, with `a` from how the
    derivative answered the last change of q. The new q is the straight line that touches the
    parabola of x, computed with that very q, at the end of the step: an implicit step of second
    order without iteration. With n = a (a x + b) + b', which is x'' if q were x, the line begins

        (h^2 / 2) |n| / (1 - a h + (a h)^2 / 2)

    beside x. The step h is the one for which that is half the quantum; where there is none, x is so
    close to its equilibrium that q becomes the equilibrium, and no step follows at all. The other
    half of the quantum is left for what the others do meanwhile, so that |x - q| <= quantum always.
    Where the derivative's answer shows that a line with what it has taught would hold much longer,
    as of an equilibrium that drifts, q is renewed once more at that instant.

    Source of the method: Migoni, Bortolotto, Kofman and Cellier, "Linearly Implicit
    Quantization-Based Integration Methods for Stiff Ordinary Differential Equations", Simulation
    Modelling Practice and Theory 35, 2013. The closed form of the step is derived here.
    """

    order = 2
    _is_explicit = False
    kept = (*State.kept, "a", "change", "short", "learns", "corrects", "may_correct")

    def __init__(
        self, path: Callable[[], str], initial: float, quantum: float, relative_quantum: float
    ) -> None:
        super().__init__(path, initial, quantum, relative_quantum)
        self.a = 0.0
        """Of the derivative by the own q, in 1/s; never above 0."""
        self.change = 0.0
        """By how much the last own event moved q, while its answer is awaited.

        The answer comes at the same instant. Without one the derivative does not read q, and an `a`
        above from a change of something else, as at an event, is none.
        """
        self.short = 0
        self.learns, self.corrects, self.may_correct = True, False, False

    def requantize(self, now: int) -> int:
        """Let q be the line that meets x at the step's end."""
        self._forget_unanswered(now)
        self.advance(now)
        q0, q1 = self._line()
        self.change = q0 - self.q0 if self.learns else 0.0
        self.learns, self.may_correct, self.corrects = True, not self.corrects, False
        self.q0, self.q1 = q0, q1
        self.width = self._quantum_at(self.x)
        self.steps += 1
        sigma = max(self._whole(self._leaves()), 1)
        self.short = self.short + 1 if sigma == 1 else 0
        if self.short >= _SHORT_STEPS:
            raise ModelError(
                f"{self._path()}: {_SHORT_STEPS} steps of 1 ns on end with a quantum of "
                f"{self.width:.3g}; expected longer ones: choose a larger quantum"
            )
        return now + sigma

    def derive(self, now: int, derivative: Sequence[float]) -> int:
        """Take a new derivative."""
        is_answer = now == self.at
        self._forget_unanswered(now)
        self.advance(now)
        if is_answer and abs(self.change) > 0.1 * self.width:
            self.a = min((derivative[0] - self.u0) / self.change, 0.0)
        self.u0, self.u1 = derivative[0], derivative[1]
        self.change = 0.0
        leaves = self._leaves()
        if is_answer and self.may_correct and self.a != 0.0:
            self.corrects = self._would_leave() > 4.0 * leaves
        self.may_correct = False
        return now if self.corrects else now + self._whole(leaves)

    def reset(self, now: int, value: float) -> int:
        """Let x be `value`; what answers that may answer the event as well."""
        self._forget_unanswered(now)
        self.learns, self.change = False, 0.0
        return super().reset(now, value)

    def _would_leave(self) -> float:
        """For how long q would hold if it were renewed now."""
        q0, q1 = self._line()
        u0, u1 = self.u0 + self.a * (q0 - self.q0), self.u1 + self.a * (q1 - self.q1)
        return _leaves(self.x - q0, u0 - q1, 0.5 * u1, self.width)

    def _forget_unanswered(self, now: int) -> None:
        if now > self.at:
            if abs(self.change) > 0.1 * self.width:
                self.a = 0.0
            self.change = 0.0

    def _line(self) -> tuple[float, float]:
        """Value and slope of the q that begins now."""
        a, x = self.a, self.x
        if self.steps == 0:
            return x, 0.0
        b0, b1 = self.u0 - a * self.q0, self.u1 - a * self.q1
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
        return _leaves(self.x - self.q0, self.u0 - self.q1, 0.5 * self.u1, self.width)


def _leaves(c0: float, c1: float, c2: float, width: float) -> float:
    """When q has to be renewed: where it comes nearest to x, or at the edge of the quantum."""
    edge = leaves_band(c0, c1, c2, width)
    if c0 * c2 > 0.0 > c1 * c2 and c1 * c1 > 0.4 * abs(c2) * width:
        return min(-c1 / (2.0 * c2), edge)
    return edge


METHODS: Final[dict[str, type[State]]] = {
    "QSS1": FirstOrder,
    "QSS2": SecondOrder,
    "QSS3": ThirdOrder,
    "LIQSS2": LinearlyImplicit,
}
