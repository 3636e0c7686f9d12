"""Wilcoxon's signed-rank test, exact, and the interval that follows from it.

Of n differences that are symmetric about 0, each of the 2**n choices of signs is as likely as any
other. W is the sum of the ranks, by size, of those that are positive. How many choices give each W
is counted as a polynomial, the product of (1 + x**rank), whose coefficients lie side by side in one
whole number. Ranks are doubled, so that the mean rank of equal sizes is a whole number too.

The interval is the one of the test turned round (Hodges and Lehmann): its ends are averages of two
differences (Walsh averages), as many in as W may be low.

Source: F. Wilcoxon, Individual comparisons by ranking methods, 1945; J. L. Hodges and E. L.
Lehmann, Estimates of location based on rank tests, 1963.
"""

from collections.abc import Sequence
from functools import cache
from itertools import combinations_with_replacement, groupby
from math import inf
from statistics import median
from typing import NamedTuple


class Interval(NamedTuple):
    """Where the centre of the differences lies; without bounds where they are too few to tell."""

    low: float
    centre: float
    high: float


def p_greater(differences: Sequence[float]) -> float:
    """How likely a W as high as this one is, or a higher, if the centre is 0 or below.

    Differences of exactly 0 are left out; 1 where none is left.
    """
    kept = [each for each in differences if each != 0]
    ranks = _doubled_ranks([abs(each) for each in kept])
    found = sum(rank for rank, each in zip(ranks, kept, strict=True) if each > 0)
    return _tail(tuple(sorted(ranks)), found)


def interval(differences: Sequence[float], level: float) -> Interval:
    """The interval that misses the centre on either side with at most this probability.

    Raises ValueError for no differences.
    """
    if not differences:
        raise ValueError("no differences; expected one at least")
    averages = sorted((one + other) / 2 for one, other in _pairs(differences))
    centre = median(averages)
    outside = _highest_unlikely(len(differences), level)
    if outside is None:
        return Interval(-inf, centre, inf)
    return Interval(averages[outside], centre, averages[-1 - outside])


def fewest(level: float) -> int:
    """How few differences can be significant at this level: all of one sign, 2**-n <= level."""
    count = 1
    while 0.5**count > level:
        count += 1
    return count


# -------------------------------------------------------------------------------------------------


def _pairs(values: Sequence[float]) -> Sequence[tuple[float, float]]:
    """Every two, and each with itself."""
    return list(combinations_with_replacement(values, 2))


def _doubled_ranks(sizes: Sequence[float]) -> list[int]:
    """Twice the rank of each, from 2 on; of equal ones twice their mean rank."""
    order = sorted(range(len(sizes)), key=sizes.__getitem__)
    ranks = [0] * len(sizes)
    below = 0
    for _, equal in groupby(order, key=sizes.__getitem__):
        places = list(equal)
        for place in places:
            ranks[place] = 2 * below + len(places) + 1
        below += len(places)
    return ranks


def _tail(ranks: tuple[int, ...], least: int) -> float:
    """The share of all choices of signs whose sum of ranks is at least this."""
    counts = _counts(ranks)
    return sum(counts[least:]) / (1 << len(ranks))


@cache
def _counts(ranks: tuple[int, ...]) -> tuple[int, ...]:
    """How many choices of signs give each sum of ranks."""
    size = len(ranks) // 8 + 1  # bytes that hold 2**n
    polynomial = 1
    for rank in ranks:
        polynomial += polynomial << (8 * size * rank)
    packed = polynomial.to_bytes(size * (sum(ranks) + 1), "little")
    places = range(0, len(packed), size)
    return tuple(int.from_bytes(packed[at : at + size], "little") for at in places)


@cache
def _highest_unlikely(count: int, level: float) -> int | None:
    """The highest W that is unlikely enough; None where even 0 is too likely."""
    counts = _counts(tuple(range(1, count + 1)))
    allowed = level * (1 << count)
    passed, highest = 0, -1
    for found in counts:
        passed += found
        if passed > allowed:
            break
        highest += 1
    return None if highest < 0 else highest
