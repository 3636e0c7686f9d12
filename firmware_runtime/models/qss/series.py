"""Truncated Taylor series as straight-line Python: how the coefficients of a result follow.

A `Series` holds the coefficients of one quantity in t, lowest first; each is a number known now or
the name of a local variable of the code that is written. What is zero is left out of the code, so
constants and straight lines cost what they must. The recurrences are those of automatic
differentiation, exact to the rounding of a float.

Source: Griewank and Walther, Evaluating Derivatives, 2nd edition, SIAM 2008, chapter 13.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

Coefficient: TypeAlias = float | str
Series: TypeAlias = list[Coefficient]


class Writer:
    """Writes the lines that compute series of one length."""

    def __init__(self, length: int, prefix: str = "v") -> None:
        self.length = length
        self.lines: list[str] = []
        self.indent = "    "
        self.is_linear = True
        """Whether every result so far is a sum of multiples of what went in."""
        self._prefix = prefix
        self._count = 0

    def assign(self, text: str) -> str:
        """A new local variable with this value."""
        name = f"{self._prefix}{self._count}"
        self._count += 1
        self.lines.append(f"{self.indent}{name} = {text}")
        return name

    def constant(self, value: float) -> Series:
        """A number that does not change."""
        return [value, *[0.0] * (self.length - 1)]

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

    # Sums and products --------------------------------------------------------------------------

    def add(self, a: Series, b: Series, sign: float = 1.0) -> Series:
        """The sum a + b, or a - b for a sign of -1."""
        return [self.total([(x, 1.0), (y, sign)]) for x, y in zip(a, b, strict=True)]

    def negative(self, a: Series) -> Series:
        """The opposite."""
        return [self.total([(x, -1.0)]) for x in a]

    def multiply(self, a: Series, b: Series) -> Series:
        """The product, by Cauchy's rule."""
        self.is_linear &= is_flat(a) or is_flat(b)
        return [self.total([(a[i], b[k - i]) for i in range(k + 1)]) for k in range(self.length)]

    def divide(self, a: Series, b: Series) -> Series:
        """The quotient."""
        if is_known(b):
            if b[0] == 0.0:
                raise ZeroDivisionError("division by zero")
            return [self.total([(x, 1.0 / float(b[0]))]) for x in a]
        inverse = self.assign(f"1.0 / {b[0]}")
        if is_flat(b):
            return [self._times(x, inverse) for x in a]
        self.is_linear = False
        result: Series = []
        for k in range(self.length):
            rest = [(self._minus(result[i]), b[k - i]) for i in range(k)]
            result.append(self._times(self.total([(a[k], 1.0), *rest]), inverse))
        return result

    def power(self, a: Series, exponent: Series) -> Series:
        """The power; whole exponents by products, so that the base may be zero or negative."""
        if not is_known(exponent):
            return self.function("exp", self.multiply(exponent, self.function("log", a)))
        number = float(exponent[0])
        if is_known(a):
            return self.constant(float(math.pow(float(a[0]), number)))
        if number.is_integer() and abs(number) <= 64:
            whole = self._whole_power(a, abs(int(number)))
            return whole if number >= 0 else self.divide(self.constant(1.0), whole)
        return self._real_power(a, number)

    # Functions ----------------------------------------------------------------------------------

    def function(self, name: str, a: Series) -> Series:
        """A function of one argument."""
        if is_known(a):
            return self.constant(float(getattr(math, name)(a[0])))
        if is_flat(a):
            return [self.assign(f"{name}({a[0]})"), *a[1:]]
        self.is_linear = False
        rule = getattr(self, f"_{name}")
        result: Series = rule(a)
        return result

    def atan2(self, y: Series, x: Series, above: str) -> Series:
        """The angle of the point (x, y); `above` says on which side of zero y is, or goes to."""
        first = self.assign(f"atan2(abs({y[0]}) if {above} else -abs({y[0]}), {x[0]})")
        if is_flat(y) and is_flat(x):
            return [first, *y[1:]]
        self.is_linear = False
        turning = self.add(
            self.multiply(x, self._slope(y)), self.multiply(y, self._slope(x)), sign=-1.0
        )
        square = self.add(self.multiply(x, x), self.multiply(y, y))
        return self._integral(first, self.divide(turning, square))

    def _exp(self, a: Series) -> Series:
        result: Series = [self.assign(f"exp({a[0]})")]
        for k in range(1, self.length):
            result.append(self._convolved(a, result, k))
        return result

    def _log(self, a: Series) -> Series:
        return self._integral(self.assign(f"log({a[0]})"), self.divide(self._slope(a), a))

    def _sqrt(self, a: Series) -> Series:
        first = self.assign(f"sqrt({a[0]})")
        result: Series = [first]
        if self.length > 1:
            half = self.assign(self._unless_zero(a, f"0.5 / {first}"))
            for k in range(1, self.length):
                inner = [(self._minus(result[i]), result[k - i]) for i in range(1, k)]
                result.append(self._times(self.total([(a[k], 1.0), *inner]), half))
        return result

    def _sin(self, a: Series) -> Series:
        return self._circular(a)[0]

    def _cos(self, a: Series) -> Series:
        return self._circular(a)[1]

    def _circular(self, a: Series) -> tuple[Series, Series]:
        sine: Series = [self.assign(f"sin({a[0]})")]
        cosine: Series = [self.assign(f"cos({a[0]})")]
        for k in range(1, self.length):
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
        return [self.total([(x, 0.5), (y, 0.5 * sign)]) for x, y in zip(up, down, strict=True)]

    def _tan(self, a: Series) -> Series:
        return self._tangent("tan", a, 1.0)

    def _tanh(self, a: Series) -> Series:
        return self._tangent("tanh", a, -1.0)

    def _tangent(self, name: str, a: Series, sign: float) -> Series:
        """Its derivative is 1 plus or minus its square."""
        result: Series = [self.assign(f"{name}({a[0]})")]
        grown: Series = []
        for k in range(1, self.length):
            square = self.total([(result[i], result[k - 1 - i]) for i in range(k)])
            grown.append(self.total([(square, sign), (1.0 if k == 1 else 0.0, 1.0)]))
            result.append(
                self.total([(self._scaled(a[i], i), grown[k - i]) for i in range(1, k + 1)], k)
            )
        return result

    def _atan(self, a: Series) -> Series:
        square = self.multiply(a, a)
        under = self.add(self.constant(1.0), square)
        return self._integral(self.assign(f"atan({a[0]})"), self.divide(self._slope(a), under))

    def _asin(self, a: Series) -> Series:
        return self._integral(self.assign(f"asin({a[0]})"), self._arc(a))

    def _acos(self, a: Series) -> Series:
        return self._integral(self.assign(f"acos({a[0]})"), self.negative(self._arc(a)))

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
        result: Series = [self.assign(f"pow({a[0]}, {exponent!r})")]
        if is_flat(a):
            return [*result, *a[1:]]
        self.is_linear = False
        inverse = self.assign(self._unless_zero(a, f"1.0 / {a[0]}"))
        for k in range(1, self.length):
            terms = [
                (self._scaled(a[i], exponent * i - (k - i)), result[k - i]) for i in range(1, k + 1)
            ]
            result.append(self._times(self.total(terms, k), inverse))
        return result

    def _unless_zero(self, a: Series, quotient: str) -> str:
        """The quotient, but 0 where a is zero and stays so: a root of that has all its slopes."""
        moving = " or ".join(str(each) for each in a if each != 0.0)
        return f"{quotient} if {moving} else 0.0"

    def _convolved(self, a: Series, b: Series, k: int) -> Coefficient:
        """Coefficient k of the integral of a' b."""
        return self.total([(self._scaled(a[i], i), b[k - i]) for i in range(1, k + 1)], k)

    def _slope(self, a: Series) -> Series:
        """a'; the last coefficient, which is not known, is left out."""
        return [*(self._scaled(a[k], k) for k in range(1, self.length)), 0.0]

    def _integral(self, first: Coefficient, slope: Series) -> Series:
        return [first, *(self._scaled(slope[k - 1], 1.0 / k) for k in range(1, self.length))]

    def _scaled(self, coefficient: Coefficient, factor: float) -> Coefficient:
        return self.total([(coefficient, float(factor))])

    def _minus(self, coefficient: Coefficient) -> Coefficient:
        return self.total([(coefficient, -1.0)])

    def _times(self, coefficient: Coefficient, factor: Coefficient) -> Coefficient:
        return self.total([(coefficient, factor)])


def is_known(a: Series) -> bool:
    """Whether it is a number, known now."""
    return isinstance(a[0], float) and is_flat(a)


def is_flat(a: Series) -> bool:
    """Whether it does not change between events."""
    return all(each == 0.0 for each in a[1:])


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
