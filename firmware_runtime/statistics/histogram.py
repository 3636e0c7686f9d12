"""A log-linear histogram of nanoseconds in fixed memory: integers only, nothing allocated.

Values below 64 have a bucket each. Above, every power of two is cut into 32 buckets of equal
width, so a bucket is never wider than 1/32 (3.1 %) of its values. With

    shift = bit length of (value >> 6)       0 below 64, 1 below 128, 2 below 256 ...
    bucket = 32 * shift + (value >> shift)   value >> shift is 32 to 63 once shift is positive

the buckets follow each other without a gap or an overlap. Values over 2**37 - 1 ns (137 s) fall
into the last one. The largest value and the sum are kept exactly, beside the buckets. A sum stops
at `LARGEST_SUM` (146 years); there is no mean then.

A percentile is the upper edge of the bucket the sample of that rank fell into, but never more than
the largest sample: it is never too low (up to 137 s) and at most 3.1 % too high.
"""

from array import array
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from itertools import accumulate
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    Cells: TypeAlias = memoryview[int]
    """Signed 64-bit cells: the format of a view is `q`."""
else:
    Cells = memoryview  # takes no type of its items while a program runs, before CPython 3.14

SUB_BUCKETS = 32
LARGEST = (1 << 37) - 1
BUCKETS = 33 * SUB_BUCKETS
"""Two linear powers (0 to 63) share the first 64; 31 further powers reach `LARGEST`."""
LARGEST_CELL, SUM_CELL = BUCKETS, BUCKETS + 1
CELLS = BUCKETS + 2
"""What a histogram takes in a file: its buckets, then the largest value, then the sum of all."""
LARGEST_SUM = 1 << 62
"""Ns that a sum comes to at most: a robot that catches up with hours reaches it."""
MOST_SAMPLES = 1 << 53
"""What no run counts in a bucket: it would take 285 years at 1 MHz."""

_STRETCH = 512
_ZEROS = bytes(8 * CELLS)
RANKS = (500, 900, 990, 999)
"""Of the percentiles of a distribution, in thousandths of the samples."""


class Distribution(Struct, frozen=True):
    """Percentiles, maximum and mean in microseconds; all None where there is no sample.

    Where the sum found no room, the mean alone is None.
    """

    p50: float | None = None
    p90: float | None = None
    p99: float | None = None
    p999: float | None = None
    max: float | None = None
    mean: float | None = None


def bucket_of(value: int) -> int:
    """The bucket `value` falls into, for values from 0 to `LARGEST`."""
    shift = (value >> 6).bit_length()
    return shift * SUB_BUCKETS + (value >> shift)


def upper_edge(bucket: int) -> int:
    """The largest value that falls into `bucket`."""
    shift = max(bucket // SUB_BUCKETS - 1, 0)
    return ((bucket - shift * SUB_BUCKETS + 1) << shift) - 1


def empty_cells(count: int = CELLS) -> Cells:
    """Cells in memory of this process, all zero."""
    return memoryview(array("q", bytes(8 * count)))


def could_be(cells: Cells) -> bool:
    """Return whether these are cells of a histogram: what a run can have counted."""
    buckets = cells[:BUCKETS]
    is_counted = min(buckets) >= 0 and max(buckets) <= MOST_SAMPLES
    return is_counted and cells[LARGEST_CELL] >= 0 and 0 <= cells[SUM_CELL] <= LARGEST_SUM


class Histogram:
    """A histogram that lives in the `CELLS` cells it is given: in a mapped file, or in memory.

    They have no other writer. `largest` is the largest sample, 0 if there is none; `sum` is the sum
    of all; both are exact.
    """

    __slots__ = ("cells", "largest", "sum")

    def __init__(self, cells: Cells) -> None:
        self.cells = cells
        self.largest = cells[LARGEST_CELL]
        self.sum = cells[SUM_CELL]

    def record(self, value: int) -> None:
        """Count one sample."""
        record_all([self, value])

    def merge(self, other: "Histogram") -> None:
        """Add the samples of another histogram to this one."""
        if other.samples == 0:  # as all are in virtual time
            return
        cells = self.cells
        for bucket, samples in enumerate(other.buckets):
            cells[bucket] += samples
        self.largest = cells[LARGEST_CELL] = max(self.largest, other.largest)
        self.sum = cells[SUM_CELL] = min(self.sum + other.sum, LARGEST_SUM)

    def state(self) -> dict[int, bytes]:
        """Its cells that are not zero, in stretches of bytes, by where these begin."""
        content = self.cells.tobytes()
        if content == _ZEROS:
            return {}
        stretches = {at: content[at : at + _STRETCH] for at in range(0, 8 * CELLS, _STRETCH)}
        return {at: each for at, each in stretches.items() if not _ZEROS.startswith(each)}

    def restore(self, state: dict[int, bytes]) -> None:
        """Have these samples. Raises ValueError or TypeError for those of no histogram."""
        content = bytearray(8 * CELLS)
        for at, each in state.items():
            content[at : at + len(each)] = each
        self.cells.cast("B")[:] = content
        if not could_be(self.cells):
            raise ValueError("counts of no histogram")
        self.largest, self.sum = self.cells[LARGEST_CELL], self.cells[SUM_CELL]

    @property
    def buckets(self) -> Cells:
        """How many samples fell into each bucket."""
        return self.cells[:BUCKETS]

    @property
    def samples(self) -> int:
        """Number of samples were counted."""
        return sum(self.buckets)

    def percentile(self, thousandths: int) -> int | None:
        """The least edge that at least so many thousandths of the samples do not pass."""
        samples = self.samples
        return next(self._percentiles([thousandths], samples)) if samples > 0 else None

    def summary_us(self) -> Distribution:
        """Percentiles, maximum and mean in microseconds."""
        samples = self.samples
        if samples == 0:
            return Distribution()
        p50, p90, p99, p999 = (edge / 1000 for edge in self._percentiles(RANKS, samples))
        mean = self.sum / samples / 1000 if self.sum < LARGEST_SUM else None
        return Distribution(p50, p90, p99, p999, self.largest / 1000, mean)

    def _percentiles(self, ranks: Sequence[int], samples: int) -> Iterator[int]:
        """The edge of the bucket in which the sample of each rank lies."""
        counted = tuple(accumulate(self.buckets))
        for rank in ranks:
            least = max(-(-samples * rank // 1000), 1)
            yield min(upper_edge(bisect_left(counted, least)), self.largest)


def record_all(samples: Sequence[Any]) -> None:
    """Count samples: a histogram and a value, in turns."""
    each = iter(samples)
    for histogram, value in zip(each, each, strict=True):
        cells = histogram.cells
        if value <= 0:  # never less: nothing starts early on a clock that never goes back
            cells[0] += 1
            continue
        total = histogram.sum + value
        if total > LARGEST_SUM:  # `min` takes longer, in every step
            total = LARGEST_SUM
        histogram.sum = cells[SUM_CELL] = total
        if value > histogram.largest:
            histogram.largest = cells[LARGEST_CELL] = value
        bounded = min(LARGEST, value)
        shift = (bounded >> 6).bit_length()
        cells[(shift << 5) + (bounded >> shift)] += 1
