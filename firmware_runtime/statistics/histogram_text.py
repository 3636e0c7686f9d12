"""Lateness in the layout of cyclictest's `--histogram`, so that scripts made for it can plot it.

One line for every microsecond, one column for every model: how many activations began so
many whole microseconds late. Buckets are at most 3.1 % wide; one that spans several microseconds is
counted at the lowest, so no activation is shown later than it was, and none is lost. As in
cyclictest, what is beyond the last line is an overflow; here the last line is the largest sample's.
"""

from collections.abc import Iterator

from firmware_runtime.statistics.histogram import Histogram, upper_edge
from firmware_runtime.statistics.statistics import Statistics

LONGEST = 100_000
"""Lines at most; what is later than 0.1 s overflows."""


def histogram_text(statistics: Statistics) -> Iterator[str]:
    """The lines, header and trailer included."""
    layout = statistics.layout
    columns = [statistics.lateness_of(index) for index in range(len(layout.models))]
    counted = [_by_microsecond(column) for column in columns]
    lines = min(max((max(each, default=0) for each in counted), default=0) + 1, LONGEST)
    yield f"# {' '.join(layout.models) or 'no model'}"
    yield "# Histogram"
    for us in range(lines):
        yield " ".join([f"{us:06d}", *(f"{each.get(us, 0):06d}" for each in counted)])
    overflows = [sum(n for us, n in each.items() if us >= lines) for each in counted]
    totals = [column.samples - over for column, over in zip(columns, overflows, strict=True)]
    yield f"# Total: {' '.join(f'{total:09d}' for total in totals)}"
    yield f"# Min Latencies: {_row([min(each, default=0) for each in counted])}"
    yield f"# Avg Latencies: {_row([_mean(column) for column in columns])}"
    yield f"# Max Latencies: {_row([column.largest // 1000 for column in columns])}"
    yield f"# Histogram Overflows: {_row(overflows)}"
    yield "# Histogram Overflow at cycle number:"
    for index in range(len(columns)):
        yield f"# Thread {index}:"


def _by_microsecond(histogram: Histogram) -> dict[int, int]:
    counted: dict[int, int] = {}
    for bucket, samples in enumerate(histogram.buckets):
        if samples > 0:
            lowest = upper_edge(bucket - 1) + 1 if bucket > 0 else 0
            counted[lowest // 1000] = counted.get(lowest // 1000, 0) + samples
    return counted


def _mean(histogram: Histogram) -> int:
    samples = histogram.samples
    return histogram.sum // samples // 1000 if samples > 0 else 0


def _row(values: list[int]) -> str:
    return " ".join(f"{value:05d}" for value in values)
