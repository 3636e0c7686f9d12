"""A series keeps its shape in bounded memory."""

import pytest

from firmware_runtime.cli.terminal_chart import MOST, Series


def test_a_short_series_is_kept_sample_by_sample() -> None:
    series = Series()
    for at in range(MOST - 1):
        series.add(at, at / 2)
    assert series.points == [(at, at / 2) for at in range(MOST - 1)]


@pytest.mark.parametrize("samples", [MOST, 2 * MOST, 10 * MOST + 7])
def test_a_long_one_is_bounded_and_keeps_its_mean(samples: int) -> None:
    series = Series()
    for at in range(samples):
        series.add(at, float(at))
    assert MOST // 2 <= len(series.points) < MOST
    width = series.points[1][0]
    assert all(value == at + (width - 1) / 2 for at, value in series.points)
    assert samples - width < series.points[-1][0] + width <= samples
