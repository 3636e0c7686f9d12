"""The decision on synthetic pairs: how often it is wrong, by seeded simulation."""

import random
from collections import Counter
from math import log

import pytest

from firmware_runtime.lab.gate.decision import (
    ERROR,
    FEWEST_PAIRS,
    LOOKS,
    Decision,
    Verdict,
    decide,
    looks_of,
)

TOLERANCE = 0.1


def decided(draws: random.Random, ratio: float, spread: float, most: int = 48) -> Decision:
    """A whole decision on pairs of this ratio, with outliers as likely on either side."""
    pairs: list[float] = []
    for number, look in enumerate(looks_of(most), 1):
        while len(pairs) < look:
            is_outlier = draws.random() < 0.05
            pairs.append(log(ratio) + draws.gauss(0, 10 * spread if is_outlier else spread))
        decision = decide(pairs, TOLERANCE, number)
        if decision.verdict is not Verdict.CANNOT_TELL:
            break
    return decision


def verdicts(ratio: float, spread: float, times: int = 300) -> Counter[Verdict]:
    draws = random.Random(2026)  # noqa: S311 -- reproducible, not secret
    return Counter(decided(draws, ratio, spread).verdict for _ in range(times))


def test_the_same_code_is_no_slower_and_a_fifth_more_is_slower() -> None:
    assert verdicts(1.0, 0.05) == {Verdict.NO_SLOWER: 300}
    assert verdicts(1.2, 0.05) == {Verdict.SLOWER: 300}


@pytest.mark.slow
def test_at_the_threshold_both_errors_are_as_rare_as_stated() -> None:
    found = verdicts(1 + TOLERANCE, 0.05, times=2000)
    # By Bonferroni 20 are expected at most; 34 or more of a chance of 1 % come once in 500 times.
    assert found[Verdict.SLOWER] < 34
    assert found[Verdict.NO_SLOWER] < 34
    assert found[Verdict.CANNOT_TELL] > 1900


def test_too_much_noise_is_no_verdict() -> None:
    found = verdicts(1.0, 0.8)
    assert found[Verdict.CANNOT_TELL] > 200
    assert found[Verdict.SLOWER] <= 3


def test_the_interval_has_the_ratio_as_often_as_stated() -> None:
    draws = random.Random(7)  # noqa: S311 -- reproducible, not secret
    found = [decided(draws, 1.05, 0.05) for _ in range(300)]
    missed = sum(not each.ratio_low <= 1.05 <= each.ratio_high for each in found)
    assert missed <= 13  # 2 * ERROR of 300 are 6; 14 or more of that chance come once in 250 times
    assert 2 * ERROR * 300 == 6


def test_verdict_interval_and_probability_say_the_same() -> None:
    draws = random.Random(3)  # noqa: S311 -- reproducible, not secret
    for _ in range(100):
        one = decided(draws, draws.uniform(0.9, 1.3), 0.05)
        assert (one.verdict is Verdict.SLOWER) == (one.ratio_low > 1 + TOLERANCE)
        assert (one.verdict is Verdict.NO_SLOWER) == (one.ratio_high < 1 + TOLERANCE)
        if one.verdict is Verdict.SLOWER:
            assert one.p_slower <= ERROR / LOOKS < one.p_no_slower


def test_looks_are_at_a_quarter_half_and_all_of_the_pairs() -> None:
    assert looks_of(96) == [24, 48, 96]
    assert looks_of(FEWEST_PAIRS) == [FEWEST_PAIRS] * LOOKS
    assert looks_of(20) == [FEWEST_PAIRS, 10, 20]
