"""White noise that belongs to an instant, not to the order of reading.

Each triple is a keyed hash of source, seed and instant, turned into three independent normal
numbers. So the same instant has the same noise however often, and after whatever else, it is read
for.
"""

import struct
from collections.abc import Callable
from functools import cache
from hashlib import blake2b
from importlib import import_module
from typing import TypeAlias

__all__ = ["InstantNoise", "part_noise"]

_CELL = 2.0**-52
_WORDS = struct.Struct("<3Q")


Quantile: TypeAlias = Callable[[float, float, float], float]
"""The quantile of a share between 0 and 1, of a mean and a standard deviation."""


def _quantile_of_the_library() -> Quantile:
    """Return the function that `statistics.NormalDist.inv_cdf` calls, without its imports."""
    try:
        module = import_module("_statistics")
    except ImportError:  # a Python without it in C
        module = import_module("statistics")
    quantile: Quantile = module._normal_dist_inv_cdf  # noqa: SLF001 -- it has no public name
    return quantile


_quantile = _quantile_of_the_library()


class InstantNoise:
    """Triples of independent normal numbers of mean zero, one triple an instant."""

    def __init__(self, source: str, seed: int, standard_deviation: float) -> None:
        self._seed = b"%s:%d:" % (source.encode(), seed)
        self._scale = standard_deviation

    def at(self, instant: int) -> tuple[float, float, float]:
        """The noise at `instant`, in the unit of the standard deviation."""
        keyed = _keyed(self._seed).copy()
        keyed.update(b"%d" % instant)
        a, b, c = _WORDS.unpack(keyed.digest())
        scale = self._scale
        # quantiles of the upper 52 bits, taken mid-cell so that 0 and 1 never occur
        return (
            scale * _quantile(((a >> 12) + 0.5) * _CELL, 0.0, 1.0),
            scale * _quantile(((b >> 12) + 0.5) * _CELL, 0.0, 1.0),
            scale * _quantile(((c >> 12) + 0.5) * _CELL, 0.0, 1.0),
        )


def part_noise(
    part: str, seed: int | None, standard_deviation: float = 1.0
) -> "InstantNoise | None":
    """The noise of a part that has its own; None for no seed: the world's values are noisy."""
    return None if seed is None else InstantNoise(part, seed, standard_deviation)


@cache
def _keyed(seed: bytes) -> blake2b:
    """A hash that has taken the seed in; each instant goes on from a copy of it."""
    return blake2b(seed, digest_size=_WORDS.size)
