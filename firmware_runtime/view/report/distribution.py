"""A histogram as a chart: how many samples took how long, both logarithmic, with percentiles."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

from msgspec.structs import asdict

from firmware_runtime.statistics.histogram import BUCKETS, Histogram, upper_edge
from firmware_runtime.statistics.number_formats import count, duration, duration_us
from firmware_runtime.view.markup import chart, element, table
from firmware_runtime.view.plot import Plot
from firmware_runtime.view.scales import Scale, count_scale, log_scale

_HEIGHT = 150
_ROW = 16
_TOGETHER = 4
"""Buckets of the file to one bar: eight bars to a power of two."""
_PERCENTILES = {"p50": 500, "p99": 990, "p99.9": 999}


class Mark(NamedTuple):
    """A line across the chart at a span of time."""

    name: str
    ns: int
    css: str = "marker"


class _Bar(NamedTuple):
    """`samples` that took at least `low` ns and less than `high`."""

    low: int
    high: int
    samples: int


def distribution(
    name: str, caption: str, histogram: Histogram, limits: Sequence[Mark] = ()
) -> Element:
    """The chart, or a sentence where there is nothing to draw.

    `name` makes its identifiers unique on the page; `limits` are drawn beside the percentiles.
    """
    if histogram.samples == 0:
        return _sentence(caption, "Nothing has been measured.")
    if histogram.largest == 0:
        return _sentence(caption, f"Zero, in each of {count(histogram.samples, 'sample')}.")
    marks = sorted((*_marks(histogram), *limits), key=lambda mark: mark.ns)
    svg = _plot(list(_bars(histogram)), marks).svg(name, caption, _description(histogram, marks))
    return chart(svg, caption, None, _percentiles(histogram), _counts(histogram))


def _plot(bars: Sequence[_Bar], marks: Sequence[Mark]) -> Plot:
    plot = Plot(_HEIGHT, above=_ROW * len(marks) + 4)
    ends = [bars[0].low, *(mark.ns * 1.1 for mark in marks)]
    across, up = log_scale(ends), count_scale(max(bar.samples for bar in bars))
    plot.axes(across, up)
    for bar in bars:
        sides = across.place(bar.low), across.place(bar.high)
        tooltip = f"{_range(bar)}: {bar.samples:,}"
        plot.box(sides, (plot.down(up.place(bar.samples)), plot.bottom), "bar", tooltip)
    _draw_marks(plot, across, marks)
    return plot


def _draw_marks(plot: Plot, across: Scale, marks: Sequence[Mark]) -> None:
    """Each mark's words have a row of their own; those in the right half are written leftwards."""
    places = [(across.place(mark.ns), mark) for mark in marks]
    right = [each for each in reversed(places) if each[0] >= 0.5]
    for row, (place, mark) in enumerate(right + [each for each in places if each[0] < 0.5]):
        down = _ROW * (row + 1)
        plot.line((place, down - _ROW + 5), (place, plot.bottom), mark.css)
        words = f"{mark.name} {duration(mark.ns)}"
        plot.text(place, down, words, f"{mark.css}-words", right=place < 0.5)


def _bars(histogram: Histogram) -> Iterator[_Bar]:
    buckets = histogram.buckets
    for first in range(0, BUCKETS, _TOGETHER):
        if samples := sum(buckets[first : first + _TOGETHER]):
            low = upper_edge(first - 1) + 1 if first > 0 else 0
            yield _Bar(low, upper_edge(first + _TOGETHER - 1) + 1, samples)


def _marks(histogram: Histogram) -> Iterator[Mark]:
    for name, thousandths in _PERCENTILES.items():
        yield Mark(name, histogram.percentile(thousandths) or 0)
    yield Mark("max", histogram.largest)


def _description(histogram: Histogram, marks: Sequence[Mark]) -> str:
    numbers = ", ".join(f"{mark.name} {duration(mark.ns)}" for mark in marks)
    return f"{count(histogram.samples, 'sample')}: {numbers}. Both axes are logarithmic."


def _percentiles(histogram: Histogram) -> Element:
    summary = asdict(histogram.summary_us())
    head = ["", *(name.replace("p999", "p99.9") for name in summary)]
    row = map(duration_us, summary.values())
    return table("Percentiles", head, [["time", *row]])


def _counts(histogram: Histogram) -> Element:
    rows: list[list[str]] = []
    counted = 0
    for bar in _bars(histogram):
        counted += bar.samples
        longer = histogram.samples - counted
        rows.append([_range(bar), f"{bar.samples:,}", f"{longer:,}"])
    return table("Samples by time", ["time", "samples", "that took longer"], rows)


def _range(bar: _Bar) -> str:
    return f"{duration(bar.low)} to {duration(bar.high)}"


def _sentence(caption: str, sentence: str) -> Element:
    return element("figure", element("figcaption", caption), element("p", sentence))
