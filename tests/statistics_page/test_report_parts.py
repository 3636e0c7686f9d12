"""The parts of a report: true to the numbers, and nothing left out."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics.histogram import Histogram, empty_cells
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view import parts
from firmware_runtime.view.report.distribution import distribution
from firmware_runtime.view.report.over_time import (
    Stretch,
    lateness_over_time,
    load_over_time,
    stretches,
)
from firmware_runtime.view.report.worst import Colours, in_row, within, worst_activations


def histogram_of(*samples: int) -> Histogram:
    histogram = Histogram(empty_cells())
    for sample in samples:
        histogram.record(sample)
    return histogram


def drawn(*samples: int, limits: tuple[parts.Level, ...] = ()) -> parts.Histogram:
    part = distribution("any", histogram_of(*samples), limits)
    assert isinstance(part, parts.Histogram)
    return part


def timeline(statistics: Statistics) -> list[Stretch]:
    return stretches(statistics.timeline, statistics.cells[ELAPSED])


@pytest.mark.slow
@given(st.lists(st.integers(0, 1 << 40), min_size=1, max_size=50))
def test_every_sample_is_in_a_bar_and_the_bars_follow_one_another(samples: list[int]) -> None:
    part = drawn(*samples, 1)
    assert sum(part.counts) == len(samples) + 1
    assert len(part.edges) == len(part.counts) + 1
    assert all(low < high for low, high in pairwise(part.edges))
    assert part.edges[0] == 1


def test_a_sample_is_in_the_bar_between_whose_edges_it_lies() -> None:
    part = drawn(50_000)
    assert part.counts == [1]
    assert part.edges[0] <= 50_000 < part.edges[1] <= 1.1 * part.edges[0]


def test_percentiles_largest_and_tolerance_are_levels_and_said() -> None:
    limit = parts.Level(MILLISECOND, "tolerance", is_limit=True)
    part = drawn(*[50_000] * 99, 2 * MILLISECOND, limits=(limit,))
    assert [each.value for each in part.levels] == sorted(each.value for each in part.levels)
    assert {each.name for each in part.levels} == {"p50", "p99", "p99.9", "max", "tolerance"}
    assert [each.name for each in part.levels if each.is_limit] == ["tolerance"]
    for said in ("p50 50.2 µs", "p99 50.2 µs", "max 2.00 ms", "tolerance 1.00 ms"):
        assert said in part.said


@pytest.mark.parametrize(
    ("samples", "said"),
    [((), "any: nothing has been measured."), ((0, 0), "any: zero, in each of 2 samples.")],
)
def test_where_there_is_nothing_to_draw_it_says_so(samples: tuple[int, ...], said: str) -> None:
    assert distribution("any", histogram_of(*samples)) == parts.Text(text=said)


def test_a_value_holds_from_the_begin_of_its_span_to_its_end(uneven: Statistics) -> None:
    run = timeline(uneven)
    assert {each.span.width_ns for each in run} == {SECOND, 15 * SECOND}
    lateness, _ = lateness_over_time(run, MILLISECOND)
    for curve, numbers in zip(
        lateness.curves,
        ([e.span.lateness_max_ns for e in run], [e.mean for e in run]),
        strict=True,
    ):
        assert curve.style == "steps"
        assert list(curve.x) == [*(each.sides_s[0] for each in run), run[-1].sides_s[1]]
        assert [each or 0 for each in curve.y] == [*numbers, numbers[-1]]
    assert [each.value for each in lateness.levels] == [MILLISECOND]


def test_where_nothing_was_measured_there_is_a_gap(uneven: Statistics) -> None:
    run = timeline(uneven)
    del run[3]
    load = load_over_time(run)
    assert load is not None
    (curve, _) = load.curves
    assert curve.y[2] == curve.y[3]
    assert curve.y[4] is None
    assert curve.x[3] == curve.x[4] == run[2].sides_s[1]


def test_late_and_skipped_are_counted_in_the_span_in_which_they_were(uneven: Statistics) -> None:
    run = timeline(uneven)
    _, counted = lateness_over_time(run, MILLISECOND)
    (stalled,) = (each for each in run if each.span.late > 0)
    for curve, number in zip(counted.curves, (4, 1), strict=True):
        assert curve.style == "columns"
        assert curve.name == ("late" if number == 1 else "skipped")
        assert [point for point in curve.points if point[1]] == [(stalled.sides_s[0], number)]


def test_mean_and_largest_are_in_the_table(uneven: Statistics) -> None:
    lateness, _ = lateness_over_time(timeline(uneven), MILLISECOND)
    (table,) = lateness.numbers
    row = ["0.000 s", "15.00 s", "150", "1", "4", "3.39 ms", "500.00 ms", "300.0 µs"]
    assert table.rows[0] == row


def test_load_is_the_share_of_what_has_passed_of_a_span(uneven: Statistics) -> None:
    load = load_over_time(timeline(uneven))
    assert load is not None
    (table,) = load.numbers
    assert table.rows[0] == ["0.000 s", "15.00 s", "150", "0.30 %", "0.60 %"]
    assert [curve.y[0] for curve in load.curves] == [pytest.approx(0.3), pytest.approx(0.6)]


def test_a_run_without_any_lateness_has_no_part_of_it() -> None:
    assert list(lateness_over_time([], None)) == []
    assert load_over_time([]) is None


def test_causes_in_a_row_add_up_to_the_time_from_deadline_to_end(uneven: Statistics) -> None:
    (worst,) = uneven.figures().worst
    causes = in_row(worst, Colours())
    named = ["steps before", "waking", "imu", "thrust", "kernel and accounting"]
    assert [piece.name for piece in causes] == named
    assert sum(piece.value for piece in causes) == worst.lateness_us + worst.step_us
    inside = [("garbage", 70), ("i2c1 0x68", 592.5)]
    assert [(piece.name, piece.value) for piece in within(worst)] == inside


def test_an_activation_says_when_it_was_how_late_and_why(uneven: Statistics) -> None:
    _, bars = worst_activations(uneven.figures().worst)
    assert isinstance(bars, parts.Bars)
    (bar,) = bars.rows
    assert (bar.title, bar.note) == ("imu at 5.700 s", "500.00 ms late, step 300.0 µs")
    assert bar.at == 5_700 * MILLISECOND
    words = [piece.words for piece in bar.lanes[0]]
    assert words[:2] == ["50.00 ms", "450.00 ms"]


def test_a_model_keeps_its_colour() -> None:
    colours = Colours()
    first = colours["imu"]
    assert colours["thrust"] != first
    assert colours["imu"] == first
