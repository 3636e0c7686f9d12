"""The decision on pairs: slower, no slower, or cannot tell, at a few looks.

Each pair gives the logarithm of HEAD's cost by BASE's. `slower` is said when it is significant that
the ratio is above 1 + tolerance, `no slower` when it is that it is below. Each of LOOKS looks tests
at ERROR / LOOKS, so that by Bonferroni either answer is false with a probability of ERROR at most,
whenever one stops.

The test is Wilcoxon's signed-rank test, exact: of n differences that are symmetric about 0, each of
the 2**n choices of signs is as likely as any other, and so is the sum of the ranks, by size, of
those that are positive. The interval is that test turned round: averages of two differences.
Sources: F. Wilcoxon, Individual comparisons by ranking methods, 1945; J. L. Hodges and E. L.
Lehmann, Estimates of location based on rank tests, 1963.
"""

from collections.abc import Sequence
from enum import StrEnum
from functools import cache
from itertools import accumulate, combinations_with_replacement
from math import ceil, exp, inf, log, log2
from statistics import median

from msgspec import Struct

ERROR = 0.01
"""The probability, over all looks, of saying `slower` of what is not, or `no slower` of what is."""
LOOKS = 3
LEVEL = ERROR / LOOKS
FEWEST_PAIRS = ceil(-log2(LEVEL))
"""So many pairs, all of one sign, can decide at a look."""
MOST_PAIRS = 480


class Verdict(StrEnum):
    """Verdict on HEAD."""

    NO_SLOWER = "no slower"
    SLOWER = "slower"
    CANNOT_TELL = "cannot tell here"


class Decision(Struct, frozen=True):
    """Decision on HEAD's cost by BASE's; it is within the bounds with 1 - 2 * ERROR."""

    verdict: Verdict
    ratio: float
    ratio_low: float
    ratio_high: float
    p_slower: float
    p_no_slower: float
    pairs: int
    looks: int


def looks_of(most: int) -> list[int]:
    """After how many pairs to look: a quarter, half, all; but never too few to decide."""
    return [max(-(-most * part // 4), FEWEST_PAIRS) for part in (1, 2, 4)]


def decide(log_ratios: Sequence[float], tolerance: float, looks: int = 1) -> Decision:
    """Decide by these pairs at one look; `tolerance` 0.1 is 10 %."""
    threshold = log(1 + tolerance)
    above = [each - threshold for each in log_ratios]
    p_slower, p_no_slower = p_greater(above), p_greater([-each for each in above])
    low, centre, high = map(exp, interval(log_ratios, LEVEL))
    verdict = Verdict.CANNOT_TELL
    if p_slower <= LEVEL:
        verdict = Verdict.SLOWER
    elif p_no_slower <= LEVEL:
        verdict = Verdict.NO_SLOWER
    count = len(log_ratios)
    return Decision(verdict, centre, low, high, p_slower, p_no_slower, count, looks)


def p_greater(differences: Sequence[float]) -> float:
    """Return the probability of such a sum of ranks, or a higher, if the centre is 0 or below.

    Differences of exactly 0 are left out, equal sizes ranked as they come; 1 where none is left.
    """
    kept = sorted((each for each in differences if each != 0), key=abs)
    found = sum(rank for rank, each in enumerate(kept, 1) if each > 0)
    return sum(_choices(len(kept))[found:]) / (1 << len(kept))


def interval(differences: Sequence[float], level: float) -> tuple[float, float, float]:
    """The lower bound, the centre and the upper bound of the differences.

    The centre is beyond either bound with this probability at most; too few have no bounds.
    """
    pairs = combinations_with_replacement(differences, 2)
    averages = sorted((one + other) / 2 for one, other in pairs)
    allowed = level * (1 << len(differences))
    outside = sum(below <= allowed for below in accumulate(_choices(len(differences))))
    if outside == 0:
        return -inf, median(averages), inf
    return averages[outside - 1], median(averages), averages[-outside]


@cache
def _choices(count: int) -> list[int]:
    """Count the choices of signs that give each sum of ranks, from 0 on.

    They are the coefficients of the product of (1 + x**rank), side by side in one whole number.
    """
    size = count // 8 + 1  # bytes that hold 2**count
    polynomial, sums = 1, count * (count + 1) // 2 + 1
    for rank in range(1, count + 1):
        polynomial += polynomial << (8 * size * rank)
    packed = polynomial.to_bytes(size * sums, "little")
    return [int.from_bytes(packed[at : at + size], "little") for at in range(0, len(packed), size)]
