"""The charts: true to the numbers, to scale, and nothing left out."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics.histogram import Histogram, empty_cells
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.report.distribution import Mark, distribution
from firmware_runtime.view.report.over_time import (
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


def shapes(chart: Element | None, tag: str, css: str) -> Iterator[Element]:
    assert chart is not None
    for each in chart.iter(tag):
        if css in each.get("class", "").split():
            yield each


def percent(shape: Element, name: str) -> float:
    return float(shape.get(name, "").removesuffix("%"))


def tooltip(shape: Element) -> str:
    return shape[0].text or ""


def words(chart: Element) -> str:
    return "".join(chart.itertext())


@pytest.mark.slow
@given(st.lists(st.integers(0, 1 << 40), min_size=1, max_size=50))
def test_every_sample_is_in_a_bar_within_the_chart(samples: list[int]) -> None:
    chart = distribution("any", "any", histogram_of(*samples, 1))
    bars = list(shapes(chart, "rect", "bar"))
    drawn = sum(int(tooltip(bar).rpartition(": ")[2].replace(",", "")) for bar in bars)
    assert drawn == len(samples) + 1
    for bar in bars:
        assert percent(bar, "x") >= 0
        assert percent(bar, "width") > 0
        assert percent(bar, "x") + percent(bar, "width") <= 100.001


def test_percentiles_largest_and_tolerance_are_marked() -> None:
    chart = distribution(
        "any", "any", histogram_of(*[50_000] * 99, 2 * MILLISECOND), [Mark("tolerance", 10**6)]
    )
    for said in ("p50 50.2 µs", "p99 50.2 µs", "max 2.00 ms", "tolerance 1.00 ms"):
        assert said in words(chart)


@pytest.mark.parametrize(
    ("samples", "said"),
    [((), "Nothing has been measured."), ((0, 0), "Zero, in each of 2 samples.")],
)
def test_where_there_is_nothing_to_draw_it_says_so(samples: tuple[int, ...], said: str) -> None:
    chart = distribution("any", "any", histogram_of(*samples))
    assert said in words(chart)
    assert chart.find(".//svg") is None


def test_spans_of_different_width_are_drawn_to_scale(uneven: Statistics) -> None:
    run = stretches(uneven.timeline, uneven.cells[ELAPSED])
    chart = lateness_over_time(run, MILLISECOND)
    columns = list(shapes(chart, "rect", "column"))
    widths = {each.span.width_ns for each in run}
    assert widths == {SECOND, 15 * SECOND}
    whole = run[-1].sides[1] - run[0].sides[0]
    for column, each in zip(columns, run, strict=True):
        assert percent(column, "width") == pytest.approx(each.covered / whole * 100, abs=0.002)


def test_late_and_skipped_spans_are_marked_where_they_were(uneven: Statistics) -> None:
    run = stretches(uneven.timeline, uneven.cells[ELAPSED])
    chart = lateness_over_time(run, MILLISECOND)
    stalled = next(each for each in run if each.span.late > 0)
    for name in ("late", "skipped"):
        (mark,) = shapes(chart, "rect", name)
        assert percent(mark, "x") == pytest.approx(
            stalled.sides[0] / run[-1].sides[1] * 100, abs=0.01
        )
    (cap,) = shapes(chart, "line", "cap")
    assert cap.get("x1") == mark.get("x")


def test_mean_and_largest_are_in_the_table(uneven: Statistics) -> None:
    run = stretches(uneven.timeline, uneven.cells[ELAPSED])
    chart = lateness_over_time(run, MILLISECOND)
    assert chart is not None
    rows = [[cell.text for cell in row] for row in chart.iter("tr")]
    assert rows[1] == ["0.000 s", "15.00 s", "150", "1", "4", "3.39 ms", "500.00 ms", "300.0 µs"]


def test_load_is_the_share_of_what_has_passed_of_a_span(uneven: Statistics) -> None:
    run = stretches(uneven.timeline, uneven.cells[ELAPSED])
    chart = load_over_time(run)
    assert chart is not None
    rows = [[cell.text for cell in row] for row in chart.iter("tr")]
    assert rows[1] == ["0.000 s", "15.00 s", "150", "0.30 %", "0.60 %"]


def test_a_run_without_any_lateness_has_no_chart_of_it() -> None:
    assert lateness_over_time([], None) is None
    assert load_over_time([]) is None


def test_causes_in_a_row_add_up_to_the_time_from_deadline_to_end(uneven: Statistics) -> None:
    (worst,) = uneven.figures().worst
    causes = in_row(worst, Colours())
    assert [cause.name for cause in causes] == [
        "steps before",
        "waking",
        "imu",
        "thrust",
        "kernel and accounting",
    ]
    assert sum(cause.us for cause in causes) == worst.lateness_us + worst.step_us
    assert [(cause.name, cause.us) for cause in within(worst)] == [
        ("garbage", 70),
        ("i2c1 0x68", 592.5),
    ]


def test_segments_fill_the_bar(uneven: Statistics) -> None:
    _, bars = worst_activations(uneven.figures().worst)
    segments = list(shapes(bars, "rect", "segment"))
    in_a_row = [each for each in segments if each.get("height") == "20"]
    assert sum(percent(each, "width") for each in in_a_row) == pytest.approx(100, abs=0.01)
    assert [percent(each, "x") for each in in_a_row] == sorted(
        percent(each, "x") for each in in_a_row
    )


def test_a_model_keeps_its_colour() -> None:
    colours = Colours()
    first = colours["imu"]
    assert colours["thrust"] != first
    assert colours["imu"] == first
