"""Numbers that are spread evenly: the first so many of a size, and one for each use of a line."""

from collections.abc import Iterator
from hashlib import blake2b
from typing import Final

BITS: Final = 64
GOLDEN: Final = 0x9E3779B97F4A7C15
"""The golden section of 2 to the power of 64, which is odd."""
OTHER: Final = 0xC13FA9A902A6328F
"""Another such number: multiples of both fill a square evenly."""
_BYTES: Final = 2
"""Of the number of a bit, a byte or an output; there are fewer in what is read at once."""


def spread(size: int, begin: int = 0) -> Iterator[int]:
    """Numbers below a size, each once, such that the first so many are spread evenly.

    They are the multiples of the golden section within a circle, from `begin` on, a share of it in
    units of 2 to the power of -64. Their gaps are of two sizes that are alike, or three; those met
    before are left out.
    """
    seen = bytearray(size)
    at, left = begin % (1 << BITS), size
    while left:
        number = at * size >> BITS
        at = (at + GOLDEN) % (1 << BITS)
        if not seen[number]:
            seen[number] = 1
            left -= 1
            yield number


def number_of(use: int) -> int:
    """Return a number for the use with this one: the same each time, and like no other's.

    The number itself would not do, as each second use may be another device's: half of the bits
    would never be tried.
    """
    return int.from_bytes(blake2b(str(use).encode(), digest_size=_BYTES).digest())
