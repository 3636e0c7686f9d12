"""Elementary functions to 50 digits, by their series: what the floats of ours are held to."""

import math
from collections.abc import Callable
from decimal import Decimal, localcontext
from typing import Final

DIGITS: Final = 60
_SMALL: Final = Decimal(10) ** -55
_NAMED: Final[dict[str, Callable[..., Decimal]]] = {}


def units_off(name: str, found: float, *arguments: float) -> float:
    """How far a float is from the true value, in units in the last place of that."""
    with localcontext() as context:
        context.prec = DIGITS
        true = _NAMED[name](*map(Decimal, arguments))
        return float(abs(Decimal(found) - true) / Decimal(math.ulp(float(true))))


def _sin(x: Decimal) -> Decimal:
    return _alternating(_within_a_turn(x), 1)


def _cos(x: Decimal) -> Decimal:
    return _alternating(_within_a_turn(x), 0)


def _atan2(y: Decimal, x: Decimal) -> Decimal:
    angle = _atan(abs(y / x))
    return (_pi() - angle if x < 0 else angle).copy_sign(y)


def _hypot(x: Decimal, y: Decimal) -> Decimal:
    return (x * x + y * y).sqrt()


def _alternating(x: Decimal, power: int) -> Decimal:
    """The series x^n / n! of every other power, with changing signs."""
    term = total = x**power if power else Decimal(1)
    while abs(term) > _SMALL * abs(total) and term:
        term *= -x * x / ((power + 1) * (power + 2))
        power += 2
        total += term
    return total


def _within_a_turn(x: Decimal) -> Decimal:
    turn = 2 * _pi()
    return x - turn * (x / turn).to_integral_value()


def _pi() -> Decimal:
    return 16 * _atan(Decimal(1) / 5) - 4 * _atan(Decimal(1) / 239)


def _atan(x: Decimal) -> Decimal:
    if x > Decimal("0.3"):
        return 2 * _atan(x / (1 + (1 + x * x).sqrt()))
    power, total, n = x, x, 1
    while abs(power) > _SMALL * abs(total):
        power *= -x * x
        n += 2
        total += power / n
    return total


_NAMED.update(
    sin=_sin, cos=_cos, atan2=_atan2, hypot=_hypot, exp=Decimal.exp, expm1=lambda x: x.exp() - 1
)
