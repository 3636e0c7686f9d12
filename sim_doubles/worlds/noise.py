"""White noise that belongs to an instant, not to the order of reading.

Each triple is a keyed hash of source, seed and instant, turned into three independent normal
numbers. So the same instant has the same noise however often, and after whatever else, it is read
for.
"""

import hashlib
import struct
from statistics import NormalDist

__all__ = ["InstantNoise"]

_CELL = 2.0**-52
_hash = hashlib.blake2b
_normal_quantile = NormalDist().inv_cdf
_words = struct.Struct("<3Q").unpack


class InstantNoise:
    """Triples of independent normal numbers of mean zero, one triple an instant."""

    def __init__(self, source: str, seed: int, standard_deviation: float) -> None:
        self._seed = b"%s:%d:" % (source.encode(), seed)
        self._scale = standard_deviation

    def at(self, instant: int) -> tuple[float, float, float]:
        """The noise at `instant`, in the unit of the standard deviation."""
        key = self._seed + b"%d" % instant
        a, b, c = _words(_hash(key, digest_size=24).digest())
        scale = self._scale
        # quantiles of the upper 52 bits, taken mid-cell so that 0 and 1 never occur
        return (
            scale * _normal_quantile(((a >> 12) + 0.5) * _CELL),
            scale * _normal_quantile(((b >> 12) + 0.5) * _CELL),
            scale * _normal_quantile(((c >> 12) + 0.5) * _CELL),
        )
