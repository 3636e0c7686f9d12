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
from firmware_runtime.models.qss.evaluation import Wires, settle
from firmware_runtime.models.qss.expression import parse
from firmware_runtime.models.qss.poles import Poles
from firmware_runtime.models.qss.program import Layout, compile_expression
from firmware_runtime.models.qss.segment import NANO, Segment, whole_after

TOLERANCE: Final = 1e-4
"""By how much, by default, a polynomial may be off what it stands for."""


class Function(Atomic):
    """Sends its expression's segment whenever an input came, a term ran out or a condition changed.

    waiting --NAME?--> sending (0) --out!--> waiting (until the segment has to be renewed)

    `inputs` are names of ports, with initial values or without; it begins once every input without
    one has sent. `order` coefficients are taken and sent. `tolerance` is in the output's unit, a
    number or a function of the inputs' coefficients; a segment lasts `longest_s` at most.
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
        longest_s: float = 0.1,
        parameters: Mapping[str, float] | None = None,
        counts: Mapping[str, int] | None = None,
        quanta: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        super().__init__(name)
        self._check(order, tolerance, longest_s)
        self.expression = expression
        self.order = order
        counts = {each: (counts or {}).get(each, order) for each in inputs}
        tree, layout = parse(expression), Layout(counts, parameters or {})
        program = compile_expression(tree, layout, order + 2)
        self._is_exact = (
            program.is_linear
            and max(counts.values(), default=1) <= order
            and not (program.reads_time and order < 2)
        )
        if self._is_exact:
            program = compile_expression(tree, layout, order)
        self.inputs = {each: self.in_port(each, Segment) for each in inputs}
        self.out = self.out_port("out", Segment)
        self._ports = tuple(self.inputs.items())
        self._wires = Wires(counts, inputs if isinstance(inputs, Mapping) else {})
        self._value, self._conditions = program.value, program.conditions
        self._sides = [False] * len(program.conditions)
        self._poles = Poles(program, layout, quanta or {})
        self._reads_time = program.reads_time
        self._tolerance = tolerance if callable(tolerance) else float(tolerance)
        self._longest_s = float(longest_s)
        self._at = 0
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
        t, flat, sides = self._at * NANO, self._wires.flat, self._sides
        try:
            leaves = settle(self._conditions, t, sides, flat, self._longest_s)
            if self._poles:
                self._poles.check(t, sides, flat, is_continuous=is_continuous)
            coefficients = self._value(t, sides, flat)
            self._renewed_in = leaves if self._is_exact else min(leaves, self._lasts(coefficients))
        except (ValueError, ArithmeticError) as error:
            raise self._wires.no_value(self, self.expression, self._at, error) from error
        self._segment = Segment(*coefficients[: self.order])
        self._sends = True
        self.sigma = 0

    def _lasts(self, coefficients: Sequence[float]) -> float:
        """For how many seconds the terms left out stay below the tolerance."""
        tolerance, order = self._tolerance, self.order
        if not isinstance(tolerance, float):
            (tolerance,) = tolerance(self._at * NANO, self._sides, self._wires.flat)
        half = 0.5 * tolerance
        seconds = self._longest_s if self._reads_time or self._wires.are_moving else inf
        first, second = abs(coefficients[order]), abs(coefficients[order + 1])
        if first > 0.0:
            seconds = min(seconds, (half / first) ** (1.0 / order))
        if second > 0.0:
            seconds = min(seconds, (half / second) ** (1.0 / (order + 1)))
        if seconds >= NANO:
            return seconds
        raise ModelError(
            f"{self.path}: {self.expression} holds for {seconds:.2g} s within {tolerance:.3g} at "
            f"{self._wires.shown(self._at)}; expected 1 ns or more: choose a larger tolerance or "
            "quantum, or, where values have run away, a smaller quantum"
        )

    def _check(self, order: int, tolerance: object, longest_s: float) -> None:
        if order not in {1, 2, 3}:
            raise ModelError(f"{self.path}: order is {order!r}; expected 1, 2 or 3")
        if isinstance(tolerance, float | int) and not (isfinite(tolerance) and tolerance > 0.0):
            raise ModelError(f"{self.path}: tolerance is {tolerance!r}; expected more than 0")
        if not longest_s > 0.0:
            raise ModelError(f"{self.path}: longest_s is {longest_s!r}; expected more than 0")
