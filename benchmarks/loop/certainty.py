"""How sure a count makes us: what share of all activations may be late when so many of some were.

Late activations of a run are taken as independent and rare, so their number is Poisson distributed.
Ones that come in rows are less informative than that, and the truth may be worse.
"""

import math

CERTAINTY = 0.95


def at_most(count: int, mean: float) -> float:
    """The probability of so many or fewer, where the mean number is known and positive."""
    return math.fsum(
        math.exp(number * math.log(mean) - mean - math.lgamma(number + 1))
        for number in range(count + 1)
    )


def highest_share(count: int, of: int) -> float:
    """The share that the truth does not exceed, with CERTAINTY, after `count` late `of` all.

    None late of 10,000 gives 3.0 in 10,000; 1 at most, however few there were.
    """
    low, high = 0.0, 4.0 * (count + 10)
    for _ in range(60):  # halves the interval down to what floats can resolve
        mean = (low + high) / 2
        if at_most(count, mean) > 1 - CERTAINTY:
            low = mean
        else:
            high = mean
    return min(high / of, 1.0)


def needed(share: float) -> int:
    """How many activations, none late, show with CERTAINTY that fewer than this share are."""
    return math.ceil(-math.log(1 - CERTAINTY) / share)
