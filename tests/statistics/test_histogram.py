import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.statistics.histogram import (
    BUCKETS,
    LARGEST,
    Distribution,
    Histogram,
    bucket_of,
    empty_cells,
    upper_edge,
)

SAMPLES = st.lists(st.integers(0, 2 * LARGEST), max_size=60)


def histogram(*samples: int) -> Histogram:
    made = Histogram(empty_cells())
    for sample in samples:
        made.record(sample)
    return made


def exact_percentile(samples: list[int], thousandths: int) -> int:
    rank = max(-(-len(samples) * thousandths // 1000), 1)
    return sorted(samples)[rank - 1]


def test_buckets_follow_each_other_without_gap_or_overlap() -> None:
    first = 0
    for bucket in range(BUCKETS):
        last = upper_edge(bucket)
        assert bucket_of(first) == bucket_of(last) == bucket
        first = last + 1
    assert first == LARGEST + 1


def test_the_range_is_from_one_nanosecond_to_over_a_hundred_seconds() -> None:
    assert upper_edge(1) == 1
    assert LARGEST > 100 * 10**9


@given(SAMPLES.filter(bool), st.sampled_from([500, 900, 990, 999]))
def test_a_percentile_is_never_too_low_and_at_most_a_thirty_second_too_high(
    samples: list[int], thousandths: int
) -> None:
    samples = [min(sample, LARGEST) for sample in samples]
    exact = exact_percentile(samples, thousandths)
    reported = histogram(*samples).percentile(thousandths)
    assert reported is not None
    assert exact <= reported <= min(exact * 33 // 32 + 1, max(samples))


@given(SAMPLES)
def test_the_maximum_is_exact_even_beyond_the_last_bucket(samples: list[int]) -> None:
    assert histogram(*samples).largest == max(samples, default=0)


@given(SAMPLES, SAMPLES)
def test_merging_equals_recording_both(first: list[int], second: list[int]) -> None:
    merged, both = histogram(*first), histogram(*first, *second)
    merged.merge(histogram(*second))
    assert merged.buckets == both.buckets
    assert merged.largest == both.largest


def test_a_single_sample_is_every_percentile() -> None:
    assert histogram(1234567).summary_us() == Distribution(*[1234.567] * 6)


def test_an_empty_one_has_no_percentiles_rather_than_zeros() -> None:
    assert histogram().summary_us() == Distribution()


def test_zero_is_a_sample() -> None:
    assert histogram(0).samples == 1
    assert histogram(0).percentile(500) == 0


@pytest.mark.parametrize("negative", [-1, -(10**9)])
def test_a_negative_sample_counts_as_zero(negative: int) -> None:
    assert histogram(negative).buckets[0] == 1


def test_one_late_sample_in_a_thousand_shows_in_the_maximum_and_not_in_the_percentiles() -> None:
    summary = histogram(*[1000] * 999, 5_000_000).summary_us()
    assert summary.p999 is not None
    assert summary.p999 < 1.1
    assert summary.max == 5000
