"""Series bounded over a stretch of time: how far off is what a Taylor polynomial leaves out.

By Taylor's theorem the error of a polynomial of degree n - 1 is the n-th coefficient, taken
somewhere within the stretch, times the n-th power of time. Here a series is a range of values and
a bound of the magnitude of each further coefficient, for every instant from now to `h` seconds
later; the recurrences are those of `series` with all signs the same. Where a value may not exist
within the stretch, as of 1/x or of a root near zero, the bound is infinite, or no number: a shorter
stretch has to be asked for.

Source: Moore, Methods and Applications of Interval Analysis, SIAM 1979, chapters 3 and 8.
"""

import math
from collections.abc import Callable, Sequence
from typing import Final

from firmware_runtime.models.qss.series import Coefficient, Series, Writer

_Range = tuple[float, float]


class Enclosures(Writer):
    """Writes the lines that bound series: least and largest value, then magnitudes."""

    head = 2

    def polynomial(self, coefficients: Sequence[Coefficient]) -> Series:
        """A polynomial in time, from all its coefficients."""
        first, *further = coefficients
        if not further:
            return self._flat([first, first], self.order)
        result: Series = []
        for end in ("min", "max"):
            text = f"{end}({further[-1]}, 0.0)"
            for each in further[-2::-1]:
                text = f"{end}({each}, 0.0) + h * ({text})"
            result.append(self.assign(f"{first} + h * ({text})"))
        for k in range(1, self.order + 1):
            powers = range(k, len(coefficients))
            terms = [
                f"{math.comb(i, k)} * abs({coefficients[i]}){' * h' * (i - k)}" for i in powers
            ]
            result.append(self.assign(" + ".join(terms)) if terms else 0.0)
        return result

    def at(self, a: Series, k: int) -> Coefficient:
        """The bound of the magnitude of a coefficient."""
        if k > 0:
            return a[k + 1]
        low, high = a[0], a[1]
        if isinstance(low, float) and isinstance(high, float):
            return max(-low, high)
        return self.assign(f"max(-{low}, {high})")

    def choice(self, test: str, body: Series, otherwise: Series) -> Series:
        """One of two, by a test that holds all the time."""
        return [
            each if each == other else self.assign(f"{each} if {test} else {other}")
            for each, other in zip(body, otherwise, strict=True)
        ]

    def add(self, a: Series, b: Series, sign: float = 1.0) -> Series:
        """The sum, or the difference for a sign of -1."""
        low, high = (b[0], b[1]) if sign > 0.0 else (b[1], b[0])
        ends = [self.total([(a[0], 1.0), (low, sign)]), self.total([(a[1], 1.0), (high, sign)])]
        return [*ends, *super().add(a[2:], b[2:])]

    def _range(self, text: str) -> Series:
        return [*self._assign_all(text, 2)]

    def _value(self, name: str, a: Series) -> Series:
        return self._range(f"{name}_({a[0]}, {a[1]})")

    def _product_value(self, a: Series, b: Series) -> Series:
        if a == b:
            return self._range(f"square_({a[0]}, {a[1]})")
        return self._range(f"product_({a[0]}, {a[1]}, {b[0]}, {b[1]})")

    def _inverse(self, a: Series) -> str:
        return f"inverse_({a[0]}, {a[1]})"

    def _quotient_value(self, a: Series, b: Series) -> Series:
        return self._range(f"quotient_({a[0]}, {a[1]}, {b[0]}, {b[1]})")

    def _power_value(self, a: Series, exponent: float) -> Series:
        return self._range(f"power_({a[0]}, {a[1]}, {exponent!r})")

    def _angle_value(self, y: Series, x: Series, above: str) -> Series:  # noqa: ARG002 -- as there
        return [-math.pi, math.pi]

    def _slope(self, a: Series) -> Series:
        first = a[2]
        low = -first if isinstance(first, float) else f"-{first}"
        return [low, first, *(self._scaled(a[k + 1], k) for k in range(2, self._order_of(a) + 1))]

    def _multiple(self, a: Series, factor: float) -> Series:
        low, high = (a[0], a[1]) if factor >= 0.0 else (a[1], a[0])
        ends = [self.total([(low, factor)]), self.total([(high, factor)])]
        return [*ends, *super()._multiple(a[2:], factor)]

    def _scaled(self, coefficient: Coefficient, factor: float) -> Coefficient:
        return super()._scaled(coefficient, abs(factor))

    def _minus(self, coefficient: Coefficient) -> Coefficient:
        return coefficient


_ALL: Final = (-math.inf, math.inf)


def _product(a: float, b: float, c: float, d: float) -> _Range:
    ends = (a * c, a * d, b * c, b * d)
    return min(ends), max(ends)


def _square(low: float, high: float) -> _Range:
    ends = (low * low, high * high)
    return (0.0 if low < 0.0 < high else min(ends)), max(ends)


def _inverse(low: float, high: float) -> float:
    if low > 0.0:
        return 1.0 / low
    return -1.0 / high if high < 0.0 else math.inf


def _quotient(a: float, b: float, c: float, d: float) -> _Range:
    return _product(a, b, 1.0 / d, 1.0 / c) if c > 0.0 or d < 0.0 else _ALL


def _power(low: float, high: float, exponent: float) -> _Range:
    if low < 0.0 or (low == 0.0 and exponent < 0.0):
        return _ALL
    try:
        ends = (math.pow(low, exponent), math.pow(high, exponent))
    except OverflowError:
        return _ALL
    return min(ends), max(ends)


def _rising(function: Callable[[float], float]) -> Callable[..., _Range]:
    """The range of a function that grows with its argument."""

    def between(low: float, high: float) -> _Range:
        try:
            return function(low), function(high)
        except (OverflowError, ValueError):
            return _ALL

    return between


def _sine(low: float, high: float) -> _Range:
    if not high - low < math.tau:
        return -1.0, 1.0
    ends = (math.sin(low), math.sin(high))
    top, bottom = (math.tau * math.ceil((low - each) / math.tau) + each for each in _TURNS)
    return (-1.0 if bottom <= high else min(ends)), (1.0 if top <= high else max(ends))


def _hyperbolic_cosine(low: float, high: float) -> _Range:
    try:
        ends = (math.cosh(low), math.cosh(high))
    except OverflowError:
        return _ALL
    return (1.0 if low < 0.0 < high else min(ends)), max(ends)


_TURNS: Final = (0.5 * math.pi, -0.5 * math.pi)
RANGES: Final[dict[str, Callable[..., float | _Range]]] = {
    "product_": _product,
    "square_": _square,
    "inverse_": _inverse,
    "quotient_": _quotient,
    "power_": _power,
    "exp_": _rising(math.exp),
    "log_": _rising(math.log),
    "sin_": _sine,
    "cos_": lambda low, high: _sine(low + 0.5 * math.pi, high + 0.5 * math.pi),
    "sinh_": _rising(math.sinh),
    "cosh_": _hyperbolic_cosine,
    "tanh_": _rising(math.tanh),
    "asin_": _rising(math.asin),
    "atan_": _rising(math.atan),
}
"""What the lines that are written call: none raises for any range."""
