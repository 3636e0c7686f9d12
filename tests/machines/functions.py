"""Digests of elementary functions over seeded arguments: equal digests are equal bits.

`python -m tests.machines.functions [COUNT]` prints them as JSON: those of the runtime, which the
machines must agree on, and those of the C library and the interpreter, which differ.
"""

import cmath
import hashlib
import json
import math
import sys
from array import array
from collections.abc import Callable, Iterable, Sequence
from typing import Final

from firmware_runtime.system import elementary

COUNT: Final = 100_000
OURS: Final = ("sin", "cos", "atan2", "hypot", "exp", "expm1")
_OF_TWO: Final = frozenset({"atan2", "hypot", "pow"})
_MULTIPLIER, _INCREMENT, _BITS = 6364136223846793005, 1442695040888963407, 64


def digests(count: int = COUNT) -> dict[str, str]:
    """SHA-256 by function of the runtime's own, of so many results each."""
    return {name: _digest(getattr(elementary, name), name, count) for name in OURS}


def digests_of_the_library(count: int = COUNT) -> dict[str, str]:
    """SHA-256 by function of `math`, and of what the interpreter does in C."""
    names = (*OURS, "tan", "log", "pow")
    some = arguments(count, 10.0)
    turned = [complex(x, y) for x, y in zip(some, some[::-1], strict=True)]
    products = [a * b for a, b in zip(turned, turned[::-1], strict=True)]
    return {
        **{name: _digest(getattr(math, name), name, count) for name in names},
        "square by **": digest_of(x**2 for x in some),
        "abs of complex": digest_of(map(abs, turned)),
        "product of complex": digest_of(_parts(products)),
        "cmath.rect": digest_of(_parts(cmath.rect(1.0, x) for x in some)),
        "sum": digest_of([sum(some)]),
    }


def arguments(count: int, largest: float) -> list[float]:
    """Seeded numbers between minus and plus `largest`, by whole numbers alone."""
    found, state = [], 20261122
    for _ in range(count):
        state = (state * _MULTIPLIER + _INCREMENT) % (1 << _BITS)
        found.append(((state >> 11) / (1 << 52) - 1.0) * largest)
    return found


def digest_of(values: Iterable[float]) -> str:
    """SHA-256 of floats, little-endian."""
    numbers = array("d", values)
    if sys.byteorder == "big":
        numbers.byteswap()
    return hashlib.sha256(numbers.tobytes()).hexdigest()


def _digest(function: Callable[..., float], name: str, count: int) -> str:
    some: Sequence[float] = arguments(count, 10.0)
    if name in {"log", "pow"}:
        some = [abs(x) for x in some]
    if name in _OF_TWO:
        return digest_of(map(function, some, some[::-1]))
    return digest_of(map(function, some))


def _parts(values: Iterable[complex]) -> Iterable[float]:
    for value in values:
        yield value.real
        yield value.imag


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    found = {"ours": digests(count), "library": digests_of_the_library(count)}
    sys.stdout.write(json.dumps(found) + "\n")
