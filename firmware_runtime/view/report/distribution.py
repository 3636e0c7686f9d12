"""A histogram as a part: how many samples took how long, both logarithmic, with percentiles."""

from collections.abc import Sequence

from msgspec.structs import asdict

from firmware_runtime.statistics.histogram import BUCKETS, Histogram, upper_edge
from firmware_runtime.statistics.number_formats import count, duration, duration_us
from firmware_runtime.view import parts
from firmware_runtime.view.parts import Level, Table, Text, table

_TOGETHER = 4
"""Buckets of the file to one bar: eight bars to a power of two."""
_PERCENTILES = {"p50": 500, "p99": 990, "p99.9": 999}


def distribution(
    title: str, histogram: Histogram, limits: Sequence[Level] = (), *, is_small: bool = False
) -> parts.Histogram | Text:
    """The part, or a sentence where there is nothing to draw.

    `limits` are drawn beside the percentiles. On the logarithmic axis 0 ns stand at 1 ns.
    """
    if histogram.samples == 0:
        return Text(text=f"{title}: nothing has been measured.")
    if histogram.largest == 0:
        return Text(text=f"{title}: zero, in each of {count(histogram.samples, 'sample')}.")
    edges, counts = _bars(histogram)
    levels = sorted((*_percentiles(histogram), *limits), key=lambda level: level.value)
    return parts.Histogram(
        title=title,
        across="ns",
        edges=[max(edge, 1) for edge in edges],
        counts=counts,
        levels=levels,
        is_log=True,
        is_small=is_small,
        said=_said(histogram, levels),
        numbers=[_percentile_table(histogram), _counts_table(edges, counts)],
    )


def _bars(histogram: Histogram) -> tuple[list[int], list[int]]:
    """Edges in ns and counts, from the first bar with a sample to the last."""
    buckets = histogram.buckets
    starts = range(0, BUCKETS, _TOGETHER)
    counts = [sum(buckets[first : first + _TOGETHER]) for first in starts]
    used = [number for number, samples in enumerate(counts) if samples]
    shown = range(used[0], used[-1] + 1)
    edges = [0 if first == 0 else upper_edge(first - 1) + 1 for first in (*starts, BUCKETS)]
    return edges[shown.start : shown.stop + 1], [counts[number] for number in shown]


def _percentiles(histogram: Histogram) -> list[Level]:
    levels = [Level(histogram.percentile(of) or 0, name) for name, of in _PERCENTILES.items()]
    return [*levels, Level(histogram.largest, "max")]


def _said(histogram: Histogram, levels: Sequence[Level]) -> str:
    numbers = ", ".join(f"{each.name} {duration(each.value)}" for each in levels)
    return f"{count(histogram.samples, 'sample')}: {numbers}. Both axes are logarithmic."


def _percentile_table(histogram: Histogram) -> Table:
    summary = asdict(histogram.summary_us())
    head = ["", *(name.replace("p999", "p99.9") for name in summary)]
    return table("Percentiles", head, [["time", *map(duration_us, summary.values())]])


def _counts_table(edges: Sequence[int], counts: Sequence[int]) -> Table:
    rows: list[list[str]] = []
    longer = sum(counts)
    for low, high, samples in zip(edges, edges[1:], counts, strict=False):
        longer -= samples
        if samples:
            rows.append([f"{duration(low)} to {duration(high)}", f"{samples:,}", f"{longer:,}"])
    return table("Samples by time", ["time", "samples", "that took longer"], rows)
