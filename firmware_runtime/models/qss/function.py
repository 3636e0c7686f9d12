"""A static function of signals and time, by an expression such as `-g * sin(a)`.

The result is the function's Taylor polynomial: exact for sums and multiples of straight lines and
parabolas. Of anything else the polynomial holds for a while only: what it leaves out is bounded
over a stretch of time, which says for how long the error is below the tolerance; then the function
is evaluated again without input. Comparisons, `abs`, `sign`, `min` and `max` change at the zero
crossings of what they compare. So do denominators: there the expression has no value.
"""

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import ClassVar, Final

from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.time import NEVER
from firmware_runtime.models.qss.expression import TIME, names_of, parse
from firmware_runtime.models.qss.poles import Poles
from firmware_runtime.models.qss.program import compile_bound, compile_expression
from firmware_runtime.models.qss.segment import NANO, whole_after
from firmware_runtime.models.qss.signals import Readings
from firmware_runtime.models.qss.watch import FIRST_SPAN_S, Watch, furthest

TOLERANCE: Final = 1e-4
"""By how much, by default, a polynomial may be off what it stands for."""
_MOST_UNBOUNDED: Final = 1000
_AT_A_POLE_S: Final = 1e-7
"""So near a change of sides a function with poles is left as it is: beyond may be none."""

Tolerance = float | Callable[[float, Sequence[bool], Sequence[float]], Sequence[float]]


class Function:
    """An expression's polynomial of `order` coefficients, and when it has to be renewed.

    `tolerance` is in the result's unit, a number or a function of the inputs' coefficients;
    `quanta` says how far off some inputs are, as absolute and relative quantum. Raises
    ExpressionError, a ModelError, for a text that is not understood, and ModelError where what it
    divides by passes zero.
    """

    kept: ClassVar = ("span", "unbounded")
    """The attributes that change."""

    def __init__(
        self,
        readings: Readings,
        *,
        order: int,
        tolerance: Tolerance = TOLERANCE,
        parameters: Mapping[str, float] | None = None,
        quanta: Mapping[str, tuple[float, float]] | None = None,
    ) -> None:
        self.readings, self.order = readings, order
        tree = parse(readings.text)
        layout = readings.layout(parameters or {})
        program = compile_expression(tree, layout, order)
        self._is_exact = program.degree < order
        self._bound = None if program.degree < inf else compile_bound(tree, layout, order)
        self._value, self.watch = program.value, Watch(program.conditions)
        self.poles = Poles(program, layout, quanta or {})
        self._reads_time = TIME in names_of(tree)
        self._tolerance = tolerance if callable(tolerance) else float(tolerance)
        self.span = FIRST_SPAN_S
        """Over how long a stretch what is left out is bounded next: a guess, from the last time."""
        self.unbounded = 0

    def evaluate(self, now: int, *, is_continuous: bool) -> tuple[Sequence[float], int]:
        """The polynomial from now on, and the instant at which it has to be renewed."""
        t, flat, sides = now * NANO, self.readings.at(now), self.watch.sides
        try:
            leaves = self.watch.settle(t, flat) if sides else inf
            has_poles = sides and self.poles
            if has_poles:
                self.poles.check(t, sides, flat, is_continuous=is_continuous)
            coefficients = self._value(t, sides, flat)
            is_at_pole = has_poles and leaves < _AT_A_POLE_S
            if not (self._is_exact or is_at_pole):
                leaves = min(leaves, self._lasts(now, flat, coefficients))
        except (ValueError, ArithmeticError) as error:
            raise self.readings.no_value(now, error) from error
        after = max(whole_after(leaves), 1)
        return coefficients[: self.order], NEVER if after >= NEVER else now + after

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
            f"{readings.path()}: {readings.text} holds for {seconds:.2g} s within {tolerance:.3g} "
            f"at {readings.shown(now)}; expected 1 ns or more: choose a larger tolerance or "
            "quantum, or, where values have run away, a smaller quantum"
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
