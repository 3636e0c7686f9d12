"""A static function of wires and time, by an expression: `Function("f", "-g * sin(a)", ["a"])`.

The result is the function's Taylor polynomial: exact for sums and multiples of straight lines and
parabolas. Of anything else the polynomial holds for a while only: the first two terms left out say
for how long the error is below the tolerance, then the function is evaluated again without input.
Comparisons, `abs`, `sign`, `min` and `max` change at the zero crossings of what they compare, found
as roots of polynomials. So are those of denominators: there the expression has no value.
"""

from collections.abc import Callable, Mapping, Sequence
from math import inf, isfinite
from typing import Final

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.models.qss.evaluation import Watch, Wires, furthest
from firmware_runtime.models.qss.expression import TIME, names_of, parse
from firmware_runtime.models.qss.poles import Poles
from firmware_runtime.models.qss.program import Layout, compile_bound, compile_expression
from firmware_runtime.models.qss.segment import NANO, Segment, whole_after

TOLERANCE: Final = 1e-4
"""By how much, by default, a polynomial may be off what it stands for."""

_MOST_UNBOUNDED: Final = 1000
_AT_A_POLE_S: Final = 1e-7
"""So near a change of sides a function with poles is left as it is: beyond may be none."""


class Function(Atomic):
    """Sends its expression's segment whenever an input came, a term ran out or a condition changed.

    waiting --NAME?--> sending (0) --out!--> waiting (until the segment has to be renewed)

    `inputs` are names of ports, with initial values or without; it begins once every input without
    one has sent. `order` coefficients are taken and sent. `tolerance` is in the output's unit, a
    number or a function of the inputs' coefficients.
    `counts` says that some inputs bring another number of coefficients than `order`, `quanta` how
    far off some are, as absolute and relative quantum. Raises ExpressionError, a ModelError, for a
    text that is not understood, and ModelError where what it divides by passes zero.
    """

    def __init__(  # noqa: PLR0913 -- all but three have defaults
        self,
        name: str,
        expression: str,
        inputs: Sequence[str] | Mapping[str, float] = (),
        *,
        order: int = 2,
        tolerance: float | Callable[[float, Sequence[bool], Sequence[float]], Sequence[float]] = (
            TOLERANCE
        ),
        parameters: Mapping[str, float] | None = None,
        counts: Mapping[str, int] | None = None,
        quanta: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        super().__init__(name)
        self._check(order, tolerance)
        self.expression = expression
        self.order = order
        counts = {each: (counts or {}).get(each, order) for each in inputs}
        tree, layout = parse(expression), Layout(counts, parameters or {})
        program = compile_expression(tree, layout, order)
        self._is_exact = program.degree < order
        self._bound = None
        if not self._is_exact and program.degree <= order + 1:
            program = compile_expression(tree, layout, order + 2)
        elif not self._is_exact:
            self._bound = compile_bound(tree, layout, order)
        self.inputs = {each: self.in_port(each, Segment) for each in inputs}
        self.out = self.out_port("out", Segment)
        self._ports = tuple(self.inputs.items())
        self._wires = Wires(counts, inputs if isinstance(inputs, Mapping) else {})
        self._value, self._watch = program.value, Watch(program.conditions)
        self._poles = Poles(program, layout, quanta or {})
        self._reads_time = TIME in names_of(tree)
        self._tolerance = tolerance if callable(tolerance) else float(tolerance)
        self._at = 0
        self._span = 1.0
        """Over how long a stretch what is left out is bounded next: a guess, from the last time."""
        self._unbounded = 0
        self._segment = Segment(0.0)
        self._renewed_in = inf
        self._sends = False

    def initialize(self) -> None:
        """Send at once if all inputs have a value."""
        if self._wires.missing:
            self.passivate("waiting")
        else:
            self._evaluate()

    def output(self) -> None:
        """Send the new segment."""
        if self._sends:
            self.out.send(self._segment)

    def internal(self) -> None:
        """Wait until the segment has to be renewed, or renew it."""
        if self._sends:
            self._sends = False
            self.hold_in("waiting", whole_after(self._renewed_in))
            return
        self._at += self.sigma
        self._wires.advance(self.sigma * NANO)
        self._evaluate(is_continuous=True)

    def external(self, elapsed: int) -> None:
        """Take new segments in; evaluate at this instant."""
        self._at += elapsed
        wires = self._wires
        if elapsed != 0:
            wires.advance(elapsed * NANO)
        for name, port in self._ports:
            if port:
                wires.put(self, name, port[-1])
        if wires.missing:
            self.continue_(elapsed)
        else:
            self._evaluate()

    def _evaluate(self, *, is_continuous: bool = False) -> None:
        t, flat, sides = self._at * NANO, self._wires.flat, self._watch.sides
        try:
            leaves = self._watch.settle(t, flat)
            if self._poles:
                self._poles.check(t, sides, flat, is_continuous=is_continuous)
            coefficients = self._value(t, sides, flat)
            is_at_pole = self._poles and leaves < _AT_A_POLE_S
            if not (self._is_exact or is_at_pole):
                leaves = min(leaves, self._lasts(coefficients))
            self._renewed_in = leaves
        except (ValueError, ArithmeticError) as error:
            raise self._wires.no_value(self, self.expression, self._at, error) from error
        self._segment = Segment(*coefficients[: self.order])
        self._sends = True
        self.sigma = 0

    def _lasts(self, coefficients: Sequence[float]) -> float:
        """For how many seconds the terms left out stay below the tolerance."""
        tolerance, order = self._tolerance, self.order
        if not isinstance(tolerance, float):
            (tolerance,) = tolerance(self._at * NANO, self._watch.sides, self._wires.flat)
        if self._bound is not None:
            seconds = self._lasts_within(tolerance)
        else:
            seconds, half = inf, 0.5 * tolerance
            for power in (order, order + 1):
                if coefficients[power] != 0.0:
                    seconds = min(seconds, (half / abs(coefficients[power])) ** (1.0 / power))
        if seconds >= NANO:
            return seconds
        raise ModelError(
            f"{self.path}: {self.expression} holds for {seconds:.2g} s within {tolerance:.3g} at "
            f"{self._wires.shown(self._at)}; expected 1 ns or more: choose a larger tolerance or "
            "quantum, or, where values have run away, a smaller quantum"
        )

    def _lasts_within(self, tolerance: float) -> float:
        """The same where more is left out than is known: by its bound over a stretch of time.

        A ns at a time where there is none for any stretch, as just before a pole; not for long.
        """
        if not self._reads_time and not self._wires.are_moving:
            return inf
        t, sides, flat = self._at * NANO, self._watch.sides, self._wires.flat
        bound, order = self._bound, self.order

        def safe(span: float) -> float:
            most = bound(t, sides, flat, span)
            if most * span**order <= tolerance:
                return span
            return (tolerance / most) ** (1.0 / order) if most < inf else 0.0

        seconds, self._span = furthest(self._span, safe)
        self._unbounded = self._unbounded + 1 if seconds == 0.0 else 0
        return NANO if 0 < self._unbounded < _MOST_UNBOUNDED else seconds

    def _check(self, order: int, tolerance: object) -> None:
        if order not in {1, 2, 3}:
            raise ModelError(f"{self.path}: order is {order!r}; expected 1, 2 or 3")
        if isinstance(tolerance, float | int) and not (isfinite(tolerance) and tolerance > 0.0):
            raise ModelError(f"{self.path}: tolerance is {tolerance!r}; expected more than 0")
