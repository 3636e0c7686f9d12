"""Numbers of a block: nan or infinity in one spoils all that is downstream, far from its cause."""

from math import isfinite
from numbers import Real

from firmware_runtime.devs.errors import ModelError


def is_finite(value: object) -> bool:
    """Whether it is a real number that a float can hold."""
    try:
        return isinstance(value, Real) and isfinite(value)
    except OverflowError:
        return False


def demand_finite(block: str, **numbers: object) -> None:
    """Refuse what is no finite number of a block, by both names."""
    for name, value in numbers.items():
        if not is_finite(value):
            raise ModelError(f"{block}: {name} is {value!r}; expected a finite number")
