"""Where something stood still: found in rates whose intervals are known."""

import pytest

from firmware_runtime.lab.experiments.curve_figures import (
    Stuck,
    first_motion_s,
    slope,
    stuck_intervals,
    value_near,
    within,
)


def rates(*stretches: tuple[float, float]) -> list[tuple[float, float]]:
    """A rate every 10 ms: stretches of so many seconds at that rate, one after the other."""
    values = [rate for for_s, rate in stretches for _ in range(round(100 * for_s))]
    return [(number / 100, rate) for number, rate in enumerate(values)]


def test_it_is_stuck_from_the_first_slow_sample_until_the_first_fast_one() -> None:
    found = stuck_intervals(rates((1, 0.5), (2, 0.001), (1, -0.5)), 0.01, 0.5)
    assert found == [Stuck(1.0, 3.0, is_released=True)]
    assert found[0].for_s == pytest.approx(2.0)


def test_rest_before_the_first_motion_is_a_delay() -> None:
    data = rates((2, 0.0), (1, 0.5), (1, 0.0))
    assert first_motion_s(data, 0.01) == pytest.approx(2.0)
    assert stuck_intervals(data, 0.01, 0.5) == [Stuck(3.0, 3.99, is_released=False)]


def test_turning_back_is_not_being_stuck() -> None:
    assert stuck_intervals(rates((1, 0.5), (0.3, 0.0), (1, -0.5)), 0.01, 0.5) == []


def test_what_never_moved_was_never_stuck() -> None:
    assert first_motion_s(rates((3, 0.001)), 0.01) is None
    assert stuck_intervals(rates((3, 0.001)), 0.01, 0.5) == []
    assert stuck_intervals([], 0.01, 0.5) == []


def test_the_slope_of_a_line_is_found_among_noise() -> None:
    points = [(at / 10, 0.3 * at / 10 + (0.01 if at % 2 else -0.01)) for at in range(100)]
    assert slope(points) == pytest.approx(0.3, abs=1e-3)
    assert slope([]) is None
    assert slope([(1.0, 2.0)]) is None


def test_points_within_and_near_an_instant() -> None:
    points = [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]
    assert within(points, 1.0, 2.0) == points[1:]
    assert [value_near(points, at) for at in (-1.0, 0.5, 1.0, 9.0)] == [1.0, 1.0, 2.0, 3.0]
    with pytest.raises(ValueError, match="no points"):
        value_near([], 0.0)
