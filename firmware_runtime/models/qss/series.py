"""Truncated Taylor series as straight-line Python: how the coefficients of a result follow.

A `Series` holds the coefficients of one quantity in t, lowest first; each is a number known now or
the name of a local variable of the code that is written. What is zero is left out of the code, so
constants and straight lines cost what they must. The recurrences are those of automatic
differentiation, exact to the rounding of a float.

What a recurrence does with the lowest coefficient, the value, and with signs are methods of their
own: `enclosure` bounds all coefficients over a stretch of time by the same recurrences.

Source: Griewank and Walther, Evaluating Derivatives, 2nd edition, SIAM 2008, chapter 13.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

Coefficient: TypeAlias = float | str
Series: TypeAlias = list[Coefficient]


class Writer:
    """Writes the lines that compute series up to one power of time."""

    def __init__(self, order: int) -> None:
        self.order = order
        self.lines: list[str] = []
        self.indent = "    "
        self._count = 0

    def assign(self, text: str) -> str:
        """A new local variable with this value."""
        name = f"v{self._count}"
        self._count += 1
        self.lines.append(f"{self.indent}{name} = {text}")
        return name

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

    # What a series begins with -------------------------------------------------------------------

    def constant(self, value: float) -> Series:
        """A number that does not change."""
        return [value, *[0.0] * self.order]

    def variable(self, name: str, count: int) -> Series:
        """An input, of which so many coefficients are known."""
        known = [f"{name}_{k}" for k in range(min(count, self.order + 1))]
        return [*known, *[0.0] * (self.order + 1 - len(known))]

    def time(self) -> Series:
        """The time itself."""
        return ["t", *[1.0, *[0.0] * self.order][: self.order]]

    def is_flat(self, a: Series) -> bool:
        """Whether it does not change between events."""
        return all(each == 0.0 for each in a[1:])

    def is_known(self, a: Series) -> bool:
        """Whether it is a number, known now."""
        return isinstance(a[0], float) and self.is_flat(a)

    def at(self, a: Series, k: int) -> Coefficient:
        """The coefficient of a power of time."""
        return a[k]

    def _value(self, name: str, a: Series) -> Series:
        return [self.assign(f"{name}({a[0]})")]

    def _product_value(self, a: Series, b: Series) -> Series:
        return [self._times(a[0], b[0])]

    def _inverse(self, a: Series) -> Coefficient:
        return self.assign(f"1.0 / {a[0]}")

    def _quotient_value(self, a: Series, b: Series, inverse: Coefficient) -> Series:  # noqa: ARG002 -- a range needs both
        return [self._times(a[0], inverse)]

    def _power_value(self, a: Series, exponent: float) -> Series:
        return [self.assign(f"pow({a[0]}, {exponent!r})")]

    def _angle_value(self, y: Series, x: Series, above: str) -> Series:
        return [self.assign(f"atan2(abs({y[0]}) if {above} else -abs({y[0]}), {x[0]})")]

    def _unless_zero(self, a: Series, numerator: float, value: Coefficient) -> Coefficient:
        """The quotient, but 0 where a is zero and stays so: a root of that has all its slopes."""
        moving = " or ".join(str(each) for each in a if each != 0.0)
        return self.assign(f"{numerator!r} / {value} if {moving} else 0.0")

    def _grown_value(self, result: Series, sign: float) -> Coefficient:
        """The slope of a tangent: 1 plus or minus its square."""
        return self.total([(self._times(result[0], result[0]), sign), (1.0, 1.0)])

    # Sums and products --------------------------------------------------------------------------

    def add(self, a: Series, b: Series, sign: float = 1.0) -> Series:
        """The sum a + b, or a - b for a sign of -1."""
        return [self.total([(x, 1.0), (y, sign)]) for x, y in zip(a, b, strict=True)]

    def negative(self, a: Series) -> Series:
        """The opposite."""
        return self._multiple(a, -1.0)

    def multiply(self, a: Series, b: Series) -> Series:
        """The product, by Cauchy's rule."""
        for one, other in ((a, b), (b, a)):
            if self.is_known(one):
                return self._multiple(other, float(one[0]))
        result = self._product_value(a, b)
        for k in range(1, self.order + 1):
            terms = [(self.at(a, i), self.at(b, k - i)) for i in range(k + 1)]
            result.append(self.total(terms))
        return result

    def divide(self, a: Series, b: Series) -> Series:
        """The quotient."""
        if self.is_known(b):
            if b[0] == 0.0:
                raise ZeroDivisionError("division by zero")
            return self._multiple(a, 1.0 / float(b[0]))
        inverse = self._inverse(b)
        result = self._quotient_value(a, b, inverse)
        for k in range(1, self.order + 1):
            rest = [(self._minus(self.at(result, i)), self.at(b, k - i)) for i in range(k)]
            result.append(self._times(self.total([(self.at(a, k), 1.0), *rest]), inverse))
        return result

    def power(self, a: Series, exponent: Series) -> Series:
        """The power; whole exponents by products, so that the base may be zero or negative."""
        if not self.is_known(exponent):
            return self.function("exp", self.multiply(exponent, self.function("log", a)))
        number = float(exponent[0])
        if self.is_known(a):
            return self.constant(float(math.pow(float(a[0]), number)))
        if number.is_integer() and abs(number) <= 64:
            whole = self._whole_power(a, abs(int(number)))
            return whole if number >= 0 else self.divide(self.constant(1.0), whole)
        return self._real_power(a, number)

    # Functions ----------------------------------------------------------------------------------

    def function(self, name: str, a: Series) -> Series:
        """A function of one argument."""
        if self.is_known(a):
            return self.constant(float(getattr(math, name)(a[0])))
        if self.is_flat(a):
            return [*self._value(name, a), *[0.0] * self.order]
        rule = getattr(self, f"_{name}")
        result: Series = rule(a)
        return result

    def atan2(self, y: Series, x: Series, above: str) -> Series:
        """The angle of the point (x, y); `above` says on which side of zero y is, or goes to."""
        first = self._angle_value(y, x, above)
        if self.is_flat(y) and self.is_flat(x):
            return [*first, *[0.0] * self.order]
        turning = self.add(
            self.multiply(x, self._slope(y)), self.multiply(y, self._slope(x)), sign=-1.0
        )
        square = self.add(self.multiply(x, x), self.multiply(y, y))
        return self._integral(first, self.divide(turning, square))

    def _exp(self, a: Series) -> Series:
        result = self._value("exp", a)
        for k in range(1, self.order + 1):
            result.append(self._convolved(a, result, k))
        return result

    def _log(self, a: Series) -> Series:
        return self._integral(self._value("log", a), self.divide(self._slope(a), a))

    def _sqrt(self, a: Series) -> Series:
        result = self._value("sqrt", a)
        half = self._unless_zero(a, 0.5, result[0])
        for k in range(1, self.order + 1):
            inner = [(self._minus(self.at(result, i)), self.at(result, k - i)) for i in range(1, k)]
            result.append(self._times(self.total([(self.at(a, k), 1.0), *inner]), half))
        return result

    def _sin(self, a: Series) -> Series:
        return self._circular(a)[0]

    def _cos(self, a: Series) -> Series:
        return self._circular(a)[1]

    def _circular(self, a: Series) -> tuple[Series, Series]:
        sine, cosine = self._value("sin", a), self._value("cos", a)
        for k in range(1, self.order + 1):
            rising, falling = self._convolved(a, cosine, k), self._convolved(a, sine, k)
            sine.append(rising)
            cosine.append(self._minus(falling))
        return sine, cosine

    def _sinh(self, a: Series) -> Series:
        return self._hyperbolic(a, -1.0)

    def _cosh(self, a: Series) -> Series:
        return self._hyperbolic(a, 1.0)

    def _hyperbolic(self, a: Series, sign: float) -> Series:
        up, down = self._exp(a), self._exp(self.negative(a))
        return self._multiple(self.add(up, down, sign), 0.5)

    def _tan(self, a: Series) -> Series:
        return self._tangent("tan", a, 1.0)

    def _tanh(self, a: Series) -> Series:
        return self._tangent("tanh", a, -1.0)

    def _tangent(self, name: str, a: Series, sign: float) -> Series:
        """Its derivative is 1 plus or minus its square."""
        result = self._value(name, a)
        grown = [self._grown_value(result, sign)]
        for k in range(1, self.order + 1):
            terms = [(self._scaled(self.at(a, i), i), grown[k - i]) for i in range(1, k + 1)]
            result.append(self.total(terms, k))
            square = self.total(
                [(self.at(result, i), self.at(result, k - i)) for i in range(k + 1)]
            )
            grown.append(self._scaled(square, sign))
        return result

    def _atan(self, a: Series) -> Series:
        under = self.add(self.constant(1.0), self.multiply(a, a))
        return self._integral(self._value("atan", a), self.divide(self._slope(a), under))

    def _asin(self, a: Series) -> Series:
        return self._integral(self._value("asin", a), self._arc(a))

    def _acos(self, a: Series) -> Series:
        return self._integral(self._value("acos", a), self.negative(self._arc(a)))

    def _arc(self, a: Series) -> Series:
        under = self.add(self.constant(1.0), self.multiply(a, a), sign=-1.0)
        return self.divide(self._slope(a), self.function("sqrt", under))

    # Parts --------------------------------------------------------------------------------------

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
        """From a * c' = exponent * c * a'."""
        result = self._power_value(a, exponent)
        if self.is_flat(a):
            return [*result, *[0.0] * self.order]
        inverse = self._unless_zero(a, 1.0, a[0])
        for k in range(1, self.order + 1):
            terms = [
                (self._scaled(self.at(a, i), exponent * i - (k - i)), self.at(result, k - i))
                for i in range(1, k + 1)
            ]
            result.append(self._times(self.total(terms, k), inverse))
        return result

    def _convolved(self, a: Series, b: Series, k: int) -> Coefficient:
        """Coefficient k of the integral of a' b."""
        terms = [(self._scaled(self.at(a, i), i), self.at(b, k - i)) for i in range(1, k + 1)]
        return self.total(terms, k)

    def _slope(self, a: Series) -> Series:
        """a'; the last coefficient, which is not known, is left out."""
        return [*(self._scaled(a[k], k) for k in range(1, self.order + 1)), 0.0]

    def _integral(self, first: Series, slope: Series) -> Series:
        powers = range(1, self.order + 1)
        return [*first, *(self._scaled(self.at(slope, k - 1), 1.0 / k) for k in powers)]

    def _multiple(self, a: Series, factor: float) -> Series:
        return [self._scaled(each, factor) for each in a]

    def _scaled(self, coefficient: Coefficient, factor: float) -> Coefficient:
        return self.total([(coefficient, float(factor))])

    def _minus(self, coefficient: Coefficient) -> Coefficient:
        return self.total([(coefficient, -1.0)])

    def _times(self, coefficient: Coefficient, factor: Coefficient) -> Coefficient:
        return self.total([(coefficient, factor)])


def _product(left: Coefficient, right: Coefficient) -> str:
    if isinstance(left, float):
        left, right = right, left
    if right == 1.0:
        return str(left)
    return (
        f"-{left}"
        if right == -1.0
        else f"{left} * {right if isinstance(right, str) else repr(right)}"
    )
