"""The decision on pairs: slower, no slower, or cannot tell, at a few looks.

Each pair gives the logarithm of HEAD's cost by BASE's. The threshold is the tolerance: `slower` is
said when it is significant that the ratio is above 1 + tolerance, `no slower` when it is that it is
below. Both are one-sided signed-rank tests. Looking several times would let chance in more often,
so the error is spent in equal parts: each of K looks tests at ERROR / K. By Bonferroni either
answer is then false with a probability of ERROR at most, whenever one stops.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import exp, log

from firmware_runtime.gate.signed_rank import fewest, interval, p_greater

ERROR = 0.01
"""The probability, over all looks, of saying `slower` of what is not, or `no slower` of what is."""
LOOKS = 3
LEVEL = ERROR / LOOKS
FEWEST_PAIRS = fewest(LEVEL)
"""So many pairs, all of one sign, can decide at a look."""
MOST_PAIRS = 480


class Verdict(StrEnum):
    """What can be said of HEAD."""

    NO_SLOWER = "no slower"
    SLOWER = "slower"
    CANNOT_TELL = "cannot tell here"


@dataclass(frozen=True, slots=True)
class Decision:
    """What pairs say; `low` to `high` has the ratio with a certainty of 1 - 2 * ERROR or more."""

    verdict: Verdict
    ratio: float
    low: float
    high: float
    p_slower: float
    """Of these pairs, or clearer ones, if the ratio is 1 + tolerance or less."""
    p_no_slower: float
    """The same, if it is 1 + tolerance or more."""
    pairs: int
    looks: int
    is_faster: bool
    """Whether the ratio is as far below 1 as the tolerance is above."""


def looks_of(most: int) -> list[int]:
    """After how many pairs to look: a quarter, half, all; but never too few to decide."""
    return [max(-(-most * part // 4), FEWEST_PAIRS) for part in (1, 2, 4)]


def decide(log_ratios: Sequence[float], tolerance: float, looks: int = 1) -> Decision:
    """What these pairs say at one look; `tolerance` 0.1 is 10 %."""
    threshold = log(1 + tolerance)
    above = [each - threshold for each in log_ratios]
    p_slower, p_no_slower = p_greater(above), p_greater([-each for each in above])
    low, centre, high = interval(log_ratios, LEVEL)
    verdict = Verdict.CANNOT_TELL
    if p_slower <= LEVEL:
        verdict = Verdict.SLOWER
    elif p_no_slower <= LEVEL:
        verdict = Verdict.NO_SLOWER
    return Decision(
        verdict,
        exp(centre),
        exp(low),
        exp(high),
        p_slower,
        p_no_slower,
        len(log_ratios),
        looks,
        is_faster=high < -threshold,
    )
