"""Truncated Taylor series as straight-line Python: how the coefficients of a result follow.

A `Series` holds the coefficients of one quantity in t, lowest first; each is a number known now or
the name of a local variable of the code that is written. What is zero is left out of the code, so
constants and straight lines cost what they must; what has been computed already is not again. A
result is as long as the shorter of its arguments. The recurrences are those of automatic
differentiation, exact to the rounding of a float; most follow from a function's derivative.

What a recurrence does with the lowest coefficient, the value, and with signs are methods of their
own: `enclosure` bounds all coefficients over a stretch of time by the same recurrences.

Source: Griewank and Walther, Evaluating Derivatives, 2nd edition, SIAM 2008, chapter 13.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import ClassVar, TypeAlias

Coefficient: TypeAlias = float | str
Series: TypeAlias = list[Coefficient]

_LARGEST_WHOLE_POWER = 64


class Writer:
    """Writes the lines that compute series up to one power of time."""

    head: ClassVar = 1
    """How many entries of a series its value takes; the further coefficients follow."""

    def __init__(self, order: int) -> None:
        self.order = order
        self.lines: list[str] = []
        self._indent = "    "
        self._count = 0
        self._written: dict[str, list[str]] = {}
        """The variables that hold what has been computed, by the text of it."""

    def variables(self, count: int) -> list[str]:
        """So many names for new local variables."""
        first, self._count = self._count, self._count + count
        return [f"v{number}" for number in range(first, self._count)]

    def let(self, names: Sequence[str], text: str) -> None:
        """Write the line that gives variables their values."""
        self.lines.append(f"{self._indent}{', '.join(names)} = {text}")

    def assign(self, text: str) -> str:
        """A local variable with this value."""
        return self._assign_all(text, 1)[0]

    def _assign_all(self, text: str, count: int) -> list[str]:
        if text not in self._written:
            self._written[text] = self.variables(count)
            self.let(self._written[text], text)
        return self._written[text]

    @contextmanager
    def branch(self, opening: str) -> Iterator[None]:
        """Write lines that are run only behind an opening such as `else:`."""
        self.lines += [f"{self._indent}{opening}", f"{self._indent}    pass"]
        outer, written = self._indent, dict(self._written)
        self._indent = f"{outer}    "
        yield
        self._indent, self._written = outer, written

    def total(
        self, terms: Sequence[tuple[Coefficient, Coefficient]], divisor: float = 1.0
    ) -> Coefficient:
        """The sum of products, divided; a number if all of it is known."""
        known, parts = 0.0, []
        for left, right in terms:
            if left == 0.0 or right == 0.0:
                continue
            if isinstance(left, float) and isinstance(right, float):
                known += left * right
            else:
                parts.append(_product(left, right))
        if not parts:
            return known / divisor
        if known != 0.0:
            parts.append(repr(known))
        text = " + ".join(parts)
        if divisor != 1.0:
            text = f"({text}) * {1.0 / divisor!r}"
        return text if text.isidentifier() else self.assign(text)

    # What a series is ----------------------------------------------------------------------------

    def constant(self, value: float) -> Series:
        """A number that does not change."""
        return self._flat([value] * self.head, self.order)

    def polynomial(self, coefficients: Sequence[Coefficient]) -> Series:
        """A polynomial in time, from all its coefficients."""
        known = coefficients[: self.order + 1]
        return self._flat(known, self.order + 1 - len(known))

    def is_flat(self, a: Series) -> bool:
        """Return whether it does not change between events."""
        return all(each == 0.0 for each in a[self.head :])

    def is_known(self, a: Series) -> bool:
        """Return whether it is a number, known now."""
        return isinstance(a[0], float) and self.is_flat(a)

    def at(self, a: Series, k: int) -> Coefficient:
        """The coefficient of a power of time."""
        return a[k]

    def _flat(self, value: Sequence[Coefficient], order: int) -> Series:
        return [*value, *[0.0] * order]

    def _order_of(self, *several: Series) -> int:
        return min(map(len, several)) - self.head

    # The value, and signs ------------------------------------------------------------------------

    def _value(self, name: str, a: Series) -> Series:
        return [self.assign(f"{name}({a[0]})")]

    def _product_value(self, a: Series, b: Series) -> Series:
        return [self._times(a[0], b[0])]

    def _inverse(self, a: Series) -> str:
        """The text of what is multiplied by in place of a division."""
        return f"1.0 / {a[0]}"

    def _quotient_value(self, a: Series, b: Series) -> Series:
        return [self._times(a[0], self.assign(self._inverse(b)))]

    def _power_value(self, a: Series, exponent: float) -> Series:
        return [self.assign(f"pow({a[0]}, {exponent!r})")]

    def _angle_value(self, y: Series, x: Series, above: str) -> Series:
        return [self.assign(f"atan2(abs({y[0]}) if {above} else -abs({y[0]}), {x[0]})")]

    def _slope(self, a: Series) -> Series:
        """a', which is shorter by one."""
        return [self._scaled(a[k], k) for k in range(1, len(a))]

    def _multiple(self, a: Series, factor: float) -> Series:
        return [self._scaled(each, factor) for each in a]

    def _scaled(self, coefficient: Coefficient, factor: float) -> Coefficient:
        return self.total([(coefficient, float(factor))])

    def _minus(self, coefficient: Coefficient) -> Coefficient:
        return self.total([(coefficient, -1.0)])

    def _times(self, coefficient: Coefficient, factor: Coefficient) -> Coefficient:
        return self.total([(coefficient, factor)])

    # Arithmetic ----------------------------------------------------------------------------------

    def add(self, a: Series, b: Series, sign: float = 1.0) -> Series:
        """The sum a + b, or a - b for a sign of -1."""
        return [self.total([(x, 1.0), (y, sign)]) for x, y in zip(a, b, strict=False)]

    def negative(self, a: Series) -> Series:
        """The opposite."""
        return self._multiple(a, -1.0)

    def multiply(self, a: Series, b: Series) -> Series:
        """The product, by Cauchy's rule."""
        for one, other in ((a, b), (b, a)):
            if self.is_known(one):
                return self._multiple(other, float(one[0]))
        result = self._product_value(a, b)
        for k in range(1, self._order_of(a, b) + 1):
            result.append(self.total([(self.at(a, i), self.at(b, k - i)) for i in range(k + 1)]))
        return result

    def divide(self, a: Series, b: Series) -> Series:
        """The quotient."""
        if self.is_known(b):
            if b[0] == 0.0:
                raise ZeroDivisionError("division by zero")
            return self._multiple(a, 1.0 / float(b[0]))
        inverse, result = self.assign(self._inverse(b)), self._quotient_value(a, b)
        for k in range(1, self._order_of(a, b) + 1):
            rest = [(self._minus(self.at(result, i)), self.at(b, k - i)) for i in range(k)]
            result.append(self._times(self.total([(self.at(a, k), 1.0), *rest]), inverse))
        return result

    def power(self, a: Series, exponent: Series) -> Series:
        """The power; whole exponents by products, so that the base may be zero or negative."""
        if not self.is_known(exponent):
            return self.function("exp", self.multiply(exponent, self.function("log", a)))
        number = float(exponent[0])
        if self.is_known(a):
            return self.constant(math.pow(float(a[0]), number))
        if number.is_integer() and abs(number) <= _LARGEST_WHOLE_POWER:
            whole = self._whole_power(a, abs(int(number)))
            return whole if number >= 0 else self.divide(self.constant(1.0), whole)
        return self._real_power(a, number)

    def _whole_power(self, a: Series, exponent: int) -> Series:
        result, square = self.constant(1.0), a
        while exponent > 0:
            if exponent & 1:
                result = self.multiply(result, square)
            exponent >>= 1
            if exponent > 0:
                square = self.multiply(square, square)
        return result

    def _real_power(self, a: Series, exponent: float) -> Series:
        """From a * c' = exponent * c * a'; what stands at zero has no slopes there."""
        result = self._power_value(a, exponent)
        if self.is_flat(a):
            return self._flat(result, self._order_of(a))
        moving = " or ".join(str(each) for each in a[self.head :] if each != 0.0)
        inverse = self.assign(f"({self._inverse(a)}) if {moving} else 0.0")
        for k in range(1, self._order_of(a) + 1):
            terms = [
                (self._scaled(self.at(a, i), exponent * i - (k - i)), self.at(result, k - i))
                for i in range(1, k + 1)
            ]
            result.append(self._times(self.total(terms, k), inverse))
        return result

    # Functions ----------------------------------------------------------------------------------

    def function(self, name: str, a: Series) -> Series:
        """A function of one argument: its value, and the integral of its derivative times a'."""
        if self.is_known(a):
            return self.constant(float(getattr(math, name)(a[0])))
        if name == "sqrt":
            return self._real_power(a, 0.5)
        result = self._value(name, a)
        if self.is_flat(a):
            return self._flat(result, self._order_of(a))
        derivative = self._derivative(name, a[:-1])
        for k in range(1, self._order_of(a) + 1):
            slopes = [self._scaled(self.at(a, i), i) for i in range(1, k + 1)]
            terms = [(each, self.at(derivative, k - i)) for i, each in enumerate(slopes, 1)]
            result.append(self.total(terms, k))
        return result

    def _derivative(self, name: str, a: Series) -> Series:
        one = self.constant(1.0)
        match name:
            case "exp" | "sinh" | "cosh" | "sin":
                other = {"exp": "exp", "sinh": "cosh", "cosh": "sinh", "sin": "cos"}
                return self.function(other[name], a)
            case "cos":
                return self.negative(self.function("sin", a))
            case "log":
                return self.divide(one, a)
            case "tanh":
                value = self.function("tanh", a)
                return self.add(one, self.multiply(value, value), sign=-1.0)
            case "atan":
                return self.divide(one, self.add(one, self.multiply(a, a)))
        under = self.add(one, self.multiply(a, a), sign=-1.0)  # of the arc sine
        return self.divide(one, self.function("sqrt", under))

    def atan2(self, y: Series, x: Series, above: str) -> Series:
        """The angle of the point (x, y); `above` says on which side of zero y is, or goes to."""
        first = self._angle_value(y, x, above)
        if self.is_flat(y) and self.is_flat(x):
            return self._flat(first, self._order_of(y, x))
        turning = self.add(
            self.multiply(x, self._slope(y)), self.multiply(y, self._slope(x)), sign=-1.0
        )
        square = self.add(self.multiply(x, x), self.multiply(y, y))
        rate = self.divide(turning, square)
        powers = range(1, self._order_of(y, x) + 1)
        return [*first, *(self._scaled(self.at(rate, k - 1), 1.0 / k) for k in powers)]


def _product(left: Coefficient, right: Coefficient) -> str:
    if isinstance(left, float):
        left, right = right, left
    if right in {1.0, -1.0}:
        return str(left) if right == 1.0 else f"-{left}"
    return f"{left} * {right if isinstance(right, str) else repr(right)}"
