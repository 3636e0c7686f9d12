"""Distributions in words, such as `uniform(2, 4)`: which values a key takes in a sweep.

Two kinds. A drawn one has a value for every share from 0 to 1, by its quantile function; each row
draws a share of its own. A grid one has values in a row, all of which are gone through.
"""

import math
import re
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Final, TypeAlias

Value: TypeAlias = bool | int | float | str

MOST_LEVELS: Final = 10_000_000
_CALL: Final = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)
_WORD: Final = re.compile(r"[^\W\d][\w.+-]*")


@dataclass(frozen=True, slots=True)
class Drawn:
    """Draws a value by a share from 0 to 1, neither of which occurs."""

    quantile: Callable[[float], Value]


@dataclass(frozen=True, slots=True)
class Grid:
    """So many values in a row, by their index."""

    size: int
    level: Callable[[int], Value]


Distribution: TypeAlias = Drawn | Grid


def distribution(text: str) -> Distribution:
    """Return the distribution in these words. Raises ValueError with a sentence for none."""
    given: object = text  # from Python it may be anything
    if not isinstance(given, str):
        raise ValueError(f"{given!r}; expected a text, such as 'uniform(2, 4)'")  # noqa: TRY004 -- as below
    found = _CALL.fullmatch(text)
    make = _MAKERS.get(found[1]) if found else None
    if found is None or make is None:
        raise ValueError(f"{text!r}: expected one of {', '.join(FORMS.values())}")
    try:
        return make(_values(found[2]))
    except ValueError as error:
        raise ValueError(f"{text!r}: {error}; expected {FORMS[found[1]]}") from None


def _values(text: str) -> list[Value]:
    """The arguments: TOML's numbers, texts, true and false, and words, which are texts."""
    found: list[Value] = []
    for word in [each.strip() for each in text.split(",")] if text.strip() else []:
        try:
            value = tomllib.loads(f"value = {word}")["value"]
        except (tomllib.TOMLDecodeError, RecursionError):
            value = word if _WORD.fullmatch(word) else None
        if not isinstance(value, bool | int | float | str):
            raise ValueError(f"{word!r} is no value")  # noqa: TRY004 -- of the words, not of code
        found.append(value)
    return found


def _numbers(values: Sequence[Value], count: int) -> list[float]:
    numbers = [each for each in values if isinstance(each, int | float) and math.isfinite(each)]
    if len(numbers) != count or len(values) != count:
        raise ValueError(f"{len(values)} arguments, of which {len(numbers)} are finite numbers")
    return numbers


def _uniform(values: Sequence[Value]) -> Distribution:
    low, high = _numbers(values, 2)
    if not low < high:
        raise ValueError("the first is not below the second")
    return Drawn(lambda share: min(low + (high - low) * share, float(high)))


def _normal(values: Sequence[Value]) -> Distribution:
    mean, deviation = _numbers(values, 2)
    if not deviation > 0:
        raise ValueError("the standard deviation is not above 0")
    return Drawn(NormalDist(mean, deviation).inv_cdf)


def _loguniform(values: Sequence[Value]) -> Distribution:
    low, high = _numbers(values, 2)
    if not 0 < low < high:
        raise ValueError("the first is not above 0 and below the second")
    ratio = math.log(high / low)
    return Drawn(lambda share: min(low * math.exp(ratio * share), float(high)))


def _choice(values: Sequence[Value]) -> Distribution:
    if not values:
        raise ValueError("nothing to choose from")
    chosen = tuple(values)
    return Drawn(lambda share: chosen[int(share * len(chosen))])


def _linspace(values: Sequence[Value]) -> Distribution:
    first, last, size = _numbers(values, 3)
    if not isinstance(size, int) or not 2 <= size <= MOST_LEVELS:
        raise ValueError(f"the third is no whole number from 2 to {MOST_LEVELS}")
    return Grid(
        size,
        lambda index: (
            float(last) if index == size - 1 else first + (last - first) * index / (size - 1)
        ),
    )


def _range(values: Sequence[Value]) -> Distribution:
    ends = [each for each in values if type(each) is int]
    if len(ends) != len(values) or len(ends) not in {1, 2}:
        raise ValueError("no whole numbers, one or two")
    first, end = (0, *ends)[-2:]
    if not 1 <= end - first <= MOST_LEVELS:
        raise ValueError(
            f"there are {max(end - first, 0)} whole numbers from {first} to below {end}, not 1 to "
            f"{MOST_LEVELS}"
        )
    return Grid(end - first, lambda index: first + index)


_MAKERS: Final[dict[str, Callable[[Sequence[Value]], Distribution]]] = {
    "uniform": _uniform,
    "normal": _normal,
    "loguniform": _loguniform,
    "choice": _choice,
    "linspace": _linspace,
    "range": _range,
}
FORMS: Final = {
    "uniform": "uniform(LOW, HIGH)",
    "normal": "normal(MEAN, DEVIATION)",
    "loguniform": "loguniform(LOW, HIGH)",
    "choice": "choice(A, B, ...)",
    "linspace": "linspace(FIRST, LAST, COUNT)",
    "range": "range(COUNT) or range(FIRST, END)",
}
"""Form of each in words."""
