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

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import cbrt, inf, isfinite, sqrt
from typing import ClassVar, Final

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.qss.segment import LONGEST_S, NANO, Signal, demand_finite, is_finite
from firmware_runtime.models.qss.watch import leaves_band

RESOLUTION: Final = 2.0**-46
"""The smallest relative quantum: below it a float hardly resolves the state."""
_SHORT_STEPS: Final = 1000
"""So many steps of 1 ns on end are a livelock."""
_ROOTS: Final[Mapping[int, Callable[[float], float]]] = {1: abs, 2: sqrt, 3: cbrt}


def quantum_faults(quantum: object, relative_quantum: object) -> Iterator[str]:
    """Return what a state's quanta are and should be, with a place for the state's name."""
    if not is_finite(quantum) or not quantum > 0.0:  # type: ignore[operator]  # a number
        yield f"quantum{{}} is {quantum!r}; expected more than 0"
    if not is_finite(relative_quantum) or not 0.0 <= relative_quantum < 1.0:  # type: ignore[operator]
        yield f"relative_quantum{{}} is {relative_quantum!r}; expected 0 or more, below 1"


class State:
    """One state that is quantized by an explicit method: QSS1, QSS2, QSS3, of order 1, 2, 3.

    `exact` is x, a polynomial of the degree `order`; `quantized` is q, one degree less. q begins
    as x does, and holds until the last coefficient of x has brought it off by the quantum: for the
    root of the quantum that the order says.

    The quantum, in the unit of x, is `max(quantum, relative_quantum * |x|)`. `steps` counts the
    polynomials of q. Each method returns the instant, in ns, at which q has to be renewed; `path`
    says of which model the state is, for errors.
    """

    kept: ClassVar[tuple[str, ...]] = ("width", "steps")
    """The attributes that change, beside the two signals."""

    def __init__(  # noqa: PLR0913, PLR0917 -- the first three identify it
        self,
        order: int,
        name: str,
        path: Callable[[], str],
        initial: float,
        quantum: float,
        relative_quantum: float,
    ) -> None:
        demand_finite(path(), initial=initial)
        for fault in quantum_faults(quantum, relative_quantum):
            raise ModelError(fault.format(""), where=path())
        self.order = order
        """How many coefficients q and the derivative have."""
        self._path = path
        self.exact, self.quantized = Signal(name, order + 1, initial), Signal(name, order, initial)
        self.quantum = float(quantum)
        self.relative_quantum = max(float(relative_quantum), RESOLUTION)
        self.steps = 0
        self.width = self._quantum_now()

    def advance(self, now: int) -> None:
        """Let time pass."""
        if self.exact.at != now:
            self.exact.bring(now)
        if self.quantized.at != now:
            self.quantized.bring(now)

    def requantize(self, now: int) -> int:
        """Let q begin as x does. Raises ModelError for a step that time cannot resolve."""
        self.advance(now)
        *self.quantized.coefficients, last = self.exact.coefficients
        self.width = self._quantum_now()
        self.steps += 1
        seconds = _ROOTS[self.order](self.width / abs(last)) if last != 0.0 else inf
        if seconds < NANO:
            raise ModelError(
                f"a step of {seconds:.2g} s with a quantum of {self.width:.3g}",
                where=self._path(),
                expected="1 ns or more: choose a larger quantum, or LIQSS2 for a stiff system",
            )
        return now + self._whole(seconds)

    def derive(self, now: int, derivative: Sequence[float]) -> int:
        """Take a new derivative.

        At the start q is renewed at once with each further coefficient that becomes known.
        """
        self.advance(now)
        self._integrate(derivative)
        if now == 0 and self.steps < self.order:
            return now
        return now + self._whole(self._leaves())

    def reset(self, now: int, value: float) -> int:
        """Let x be `value`; q follows at once."""
        demand_finite(self._path(), reset=value)
        self.advance(now)
        self.exact.coefficients[0] = value
        return now

    def _integrate(self, derivative: Sequence[float]) -> None:
        if not isfinite(sum(derivative)):
            raise ModelError(
                f"its derivative is {derivative[0]}", where=self._path(), expected="a finite number"
            )
        x = self.exact.coefficients
        x[1] = derivative[0]
        if self.order > 1:
            x[2] = 0.5 * derivative[1]
        if self.order > 2:
            x[3] = derivative[2] / 3.0

    def _leaves(self) -> float:
        """In how many seconds x is off q by the quantum."""
        x, q = self.exact.coefficients, self.quantized.coefficients
        apart = [a - b for a, b in zip(x, [*q, 0.0], strict=True)]
        return leaves_band(self.width, *apart)

    @staticmethod
    def _whole(seconds: float) -> int:
        """Rounded down, so that |x - q| stays within the quantum."""
        return int(seconds * 1e9) if seconds < LONGEST_S else NEVER

    def _quantum_now(self) -> float:
        return max(self.quantum, self.relative_quantum * abs(self.exact.coefficients[0]))


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

    kept = (*State.kept, "at", "a", "change", "short", "learns", "corrects", "may_correct")

    at: int = 0
    """The instant of its last event, in ns."""
    a: float = 0.0
    """Of the derivative by the own q, in 1/s; never above 0."""
    change: float = 0.0
    """By how much the last own event moved q, while its answer is awaited.

    The answer comes at the same instant. Without one the derivative does not read q, and an `a`
    above from a change of something else, as at an event, is none.
    """
    short: int = 0
    """How many steps of 1 ns there have been on end."""
    learns: bool = True
    corrects: bool = False
    may_correct: bool = False

    def requantize(self, now: int) -> int:
        """Let q be the line that meets x at the step's end."""
        self.advance(now)
        line, q = self._line(), self.quantized.coefficients
        self.change = line[0] - q[0] if self.learns else 0.0
        self.learns, self.may_correct, self.corrects = True, not self.corrects, False
        q[:] = line
        self.width = self._quantum_now()
        self.steps += 1
        sigma = max(self._whole(self._leaves()), 1)
        self.short = self.short + 1 if sigma == 1 else 0
        if self.short >= _SHORT_STEPS:
            raise ModelError(
                f"{_SHORT_STEPS} steps of 1 ns on end with a quantum of {self.width:.3g}",
                where=self._path(),
                expected="longer ones: choose a larger quantum",
            )
        return now + sigma

    def derive(self, now: int, derivative: Sequence[float]) -> int:
        """Take a new derivative."""
        is_answer = now == self.at
        self.advance(now)
        if is_answer and abs(self.change) > 0.1 * self.width:
            self.a = min((derivative[0] - self.exact.coefficients[1]) / self.change, 0.0)
        self._integrate(derivative)
        self.change = 0.0
        leaves = self._leaves()
        if is_answer and self.may_correct and self.a != 0.0:
            self.corrects = self._would_leave() > 4.0 * leaves
        self.may_correct = False
        return now if self.corrects else now + self._whole(leaves)

    def reset(self, now: int, value: float) -> int:
        """Let x be `value`; what answers that may answer the event as well."""
        due = super().reset(now, value)
        self.learns, self.change = False, 0.0
        return due

    def advance(self, now: int) -> None:
        """Let time pass; an answer that has not come by then does not come."""
        if now > self.at:
            if abs(self.change) > 0.1 * self.width:
                self.a = 0.0
            self.change = 0.0
            self.at = now
            super().advance(now)

    def _would_leave(self) -> float:
        """For how long q would hold if it were renewed now."""
        x, slope, curvature = self.exact.coefficients
        q0, q1 = self._line()
        moved = q0 - self.quantized.coefficients[0], q1 - self.quantized.coefficients[1]
        u0, u1 = slope + self.a * moved[0], 2.0 * curvature + self.a * moved[1]
        return _nearest_or_edge(x - q0, u0 - q1, 0.5 * u1, self.width)

    def _line(self) -> tuple[float, float]:
        """Value and slope of the q that begins now."""
        a, (x, slope, curvature) = self.a, self.exact.coefficients
        q0, q1 = self.quantized.coefficients
        if self.steps == 0:
            return x, 0.0
        b0, b1 = slope - a * q0, 2.0 * curvature - a * q1
        curving = a * (a * x + b0) + b1
        if curving == 0.0:
            return x, a * x + b0
        half = 0.5 * self._quantum_now()
        excess = abs(curving) - half * a * a
        if excess <= 0.0:
            return -(b0 + b1 / a) / a, -b1 / a
        root = sqrt(max(2.0 * half * abs(curving) - (half * a) ** 2, 0.0))
        step = (root - half * a) / excess
        beside = half if curving > 0.0 else -half
        slope = (a * (x - beside) + b0 + b1 * step) / (1.0 - a * step)
        return x - beside, slope

    def _leaves(self) -> float:
        (x, slope, curvature), (q0, q1) = self.exact.coefficients, self.quantized.coefficients
        return _nearest_or_edge(x - q0, slope - q1, curvature, self.width)


def _nearest_or_edge(c0: float, c1: float, c2: float, width: float) -> float:
    """Return when q is to be renewed: nearest to x, or at the edge of the quantum."""
    edge = leaves_band(width, c0, c1, c2)
    if c0 * c2 > 0.0 > c1 * c2 and c1 * c1 > 0.4 * abs(c2) * width:
        return min(-c1 / (2.0 * c2), edge)
    return edge


METHODS: Final[Mapping[str, Callable[..., State]]] = {
    **{f"QSS{order}": partial(State, order) for order in _ROOTS},
    "LIQSS2": partial(LinearlyImplicit, 2),
}
"""What makes a state by each method."""
