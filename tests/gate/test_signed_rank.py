"""Wilcoxon's signed-rank test and its interval, against published tables and every choice."""

import random
from itertools import product
from math import inf
from statistics import StatisticsError

import pytest

from firmware_runtime.lab.gate.decision import FEWEST_PAIRS, LEVEL, interval, p_greater

CRITICAL = {5: 0, 6: 2, 7: 3, 8: 5, 9: 8, 10: 10, 12: 17, 15: 30, 20: 60, 25: 100, 30: 151}
"""The largest smaller sum of ranks that is significant at 0.05, one-sided, by n; F. Wilcoxon and
R. A. Wilcox, Some rapid approximate statistical procedures, 1964, as textbooks print it."""
DARWIN = (49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48)
"""Heights of crossed less self-fertilised plants, eighths of an inch; R. A. Fisher, The Design of
Experiments, 1935. Its signed ranks add up to 24 for the negative ones."""


def with_sum(count: int, negative: int) -> list[float]:
    """Differences of sizes 1 to `count` whose negative ranks have this sum."""
    signs = {}
    for rank in range(count, 0, -1):
        signs[rank] = -1.0 if rank <= negative else 1.0
        negative -= rank if rank <= negative else 0
    return [rank * sign for rank, sign in signs.items()]


@pytest.mark.parametrize(("count", "critical"), CRITICAL.items())
def test_critical_sums_are_those_of_the_table(count: int, critical: int) -> None:
    assert p_greater(with_sum(count, critical)) <= 0.05 < p_greater(with_sum(count, critical + 1))


def test_darwins_plants_have_the_published_probability() -> None:
    assert p_greater(DARWIN) == pytest.approx(0.0413 / 2, abs=5e-5)


def test_every_choice_of_signs_is_counted_also_with_equal_sizes() -> None:
    observed = [1.0, -2.0, 2.0, 3.0, -5.0, 5.0, 5.0]
    found = 1 + 3 + 4 + 6 + 7
    choices = [
        sum(rank for rank, is_positive in enumerate(signs, 1) if is_positive)
        for signs in product((False, True), repeat=len(observed))
    ]
    assert p_greater(observed) == sum(each >= found for each in choices) / len(choices)


def test_nothing_is_significant_of_nothing() -> None:
    assert p_greater([]) == p_greater([0.0, 0.0]) == 1


def test_the_fewest_that_can_be_significant() -> None:
    same_sign = [float(size) for size in range(1, FEWEST_PAIRS + 1)]
    assert p_greater(same_sign) <= LEVEL < p_greater(same_sign[1:])


def test_the_interval_is_the_test_turned_round() -> None:
    draws = random.Random(14)  # noqa: S311 -- reproducible, not secret
    for count in (9, 15, 40):
        differences = [draws.gauss(0.3, 1.0) for _ in range(count)]
        low, centre, high = interval(differences, 0.05)
        assert low < centre < high
        for shift, is_rejected in ((low - 1e-9, True), (low + 1e-9, False)):
            assert (p_greater([each - shift for each in differences]) <= 0.05) is is_rejected
        for shift, is_rejected in ((high + 1e-9, True), (high - 1e-9, False)):
            assert (p_greater([shift - each for each in differences]) <= 0.05) is is_rejected


def test_too_few_differences_bound_nothing() -> None:
    assert interval([1.0, 2.0, 3.0], 0.01) == (-inf, 2.0, inf)
    with pytest.raises(StatisticsError):
        interval([], 0.01)
