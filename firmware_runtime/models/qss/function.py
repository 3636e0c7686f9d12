"""A static function of signals and time, by an expression such as `-g * sin(a)`.

The result is the function's Taylor polynomial: exact for sums and multiples of straight lines and
parabolas. Of anything else the polynomial holds for a while only: what it leaves out is bounded
over a stretch of time, which says for how long the error is below the tolerance; then the function
is evaluated again without input. Comparisons, `abs`, `sign`, `min` and `max` change at the zero
crossings of what they compare. So do denominators: there the expression has no value.
"""

import ast
from collections.abc import Mapping, Sequence
from math import inf
from typing import ClassVar, Final

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.models.qss.expression import TIME, names_of
from firmware_runtime.models.qss.program import Code, Quanta, compile_allowance, compile_expression
from firmware_runtime.models.qss.segment import NANO, Readings, next_instant
from firmware_runtime.models.qss.watch import FIRST_SPAN_S, Watch, furthest

TOLERANCE: Final = 1e-4
"""By how much, by default, a polynomial may be off what it stands for."""
_MOST_UNBOUNDED: Final = 1000
_AT_A_POLE_S: Final = 1e-7
"""So near a change of sides a function with poles is left as it is: beyond may be none."""
_NEAR: Final = 8.0
"""In allowances, each a quarter of what quanta cause: a quantized input jumps by two at most."""


class Function:
    """An expression's polynomial of `order` coefficients, and when it has to be renewed.

    `tolerance` is a number in the result's unit, or what follows from how far off inputs are.
    Raises ExpressionError, a ModelError, for a text that is not understood, and ModelError where
    what it divides by passes zero.
    """

    kept: ClassVar = ("span", "unbounded", "above")
    """The attributes that change."""

    def __init__(
        self,
        readings: Readings,
        tree: ast.expr,
        *,
        order: int,
        tolerance: float | Quanta = TOLERANCE,
    ) -> None:
        self.readings, self.order = readings, order
        layout = readings.layout
        program = compile_expression(tree, layout, order, is_bounded=True)
        self._is_exact = program.degree < order
        self._value, self._bound = program.value, program.bound
        self.watch = Watch(program.conditions)
        widths: Mapping[str, tuple[float, float]] = {}
        self._tolerance: float | Code
        if isinstance(tolerance, Quanta):
            widths = tolerance.of_inputs
            self._tolerance = compile_allowance(tree, layout, tolerance)
        else:
            self._tolerance = float(tolerance)
        self._poles = [
            (number, ast.unparse(pole), compile_allowance(pole, layout, Quanta(widths, 0.0)))
            for number, pole in program.poles.items()
        ]
        self.above: list[bool | None] = [None] * len(self._poles)
        """On which side of zero what must not pass it was."""
        self._reads_time = TIME in names_of(tree)
        self.span = FIRST_SPAN_S
        """Over how long a stretch what is left out is bounded next: a guess, from the last time."""
        self.unbounded = 0

    def evaluate(self, now: int, *, is_continuous: bool) -> tuple[Sequence[float], int]:
        """The polynomial from now on, and the instant at which it has to be renewed."""
        t, flat, sides = now * NANO, self.readings.at(now), self.watch.sides
        try:
            leaves = self.watch.settle(t, flat) if sides else inf
            if self._poles:
                self._check_poles(t, flat, is_continuous=is_continuous)
            coefficients = self._value(t, sides, flat)
            is_at_pole = self._poles and leaves < _AT_A_POLE_S
            if not (self._is_exact or is_at_pole):
                leaves = min(leaves, self._lasts(now, flat, coefficients))
        except (ValueError, ArithmeticError) as error:
            raise self.readings.no_value(now, error) from error
        return coefficients[: self.order], next_instant(now, leaves)

    def _check_poles(self, t: float, flat: Sequence[float], *, is_continuous: bool) -> None:
        """Raise ZeroDivisionError if what must not has gone through zero since the last call.

        Where inputs have jumped since, what is farther from zero than their quanta has been set to
        the other side, and has not gone through.
        """
        sides = self.watch.sides
        for index, (number, pole, allowance) in enumerate(self._poles):
            was, self.above[index] = self.above[index], sides[number]
            if was is None or was is sides[number]:
                continue
            (near,) = allowance(t, sides, flat)
            value = self.watch.conditions[number].code(t, sides, flat)[0]
            if is_continuous or abs(value) <= _NEAR * near:
                raise ZeroDivisionError(f"{pole} goes through 0")

    def _lasts(self, now: int, flat: Sequence[float], coefficients: Sequence[float]) -> float:
        """For how many seconds what is left out stays below the tolerance."""
        tolerance, order = self._tolerance, self.order
        if not isinstance(tolerance, float):
            (tolerance,) = tolerance(now * NANO, self.watch.sides, flat)
        if self._bound is not None:
            seconds = self._lasts_within(tolerance, now * NANO, flat)
        else:
            seconds, half = inf, 0.5 * tolerance
            for power in (order, order + 1):
                if coefficients[power] != 0.0:
                    seconds = min(seconds, (half / abs(coefficients[power])) ** (1.0 / power))
        if seconds >= NANO:
            return seconds
        readings = self.readings
        raise ModelError(
            f"{readings.text} holds for {seconds:.2g} s within {tolerance:.3g} at "
            f"{readings.shown(now)}",
            where=readings.path(),
            expected="1 ns or more: choose a larger tolerance or quantum, or, where values "
            "have run away, a smaller quantum",
        )

    def _lasts_within(self, tolerance: float, t: float, flat: Sequence[float]) -> float:
        """The same where more is left out than is known: by its bound over a stretch of time.

        A ns at a time where there is none for any stretch, as just before a pole; not for long.
        """
        bound, order, sides = self._bound, self.order, self.watch.sides
        if bound is None or not (self._reads_time or self.readings.are_moving):
            return inf

        def safe(span: float) -> float:
            most = bound(t, sides, flat, span)
            if most * span**order <= tolerance:
                return span
            return (tolerance / most) ** (1.0 / order) if most < inf else 0.0

        seconds, self.span = furthest(self.span, safe, lambda: inf)
        self.unbounded = self.unbounded + 1 if seconds == 0.0 else 0
        return NANO if 0 < self.unbounded < _MOST_UNBOUNDED else seconds
