"""How a run went over time, in fixed memory: the last two minutes by the second, before coarsely.

Every level is a ring of `SLOTS` spans of one width. The writer keeps two maxima for a step, nothing
else: once a second it writes, at every level, what the run's counters have grown by since the span
under way began. What is not written yet is lost when a process is killed; the counters are not.
"""

from collections.abc import Callable, Sequence

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import SLOT, SLOTS, WIDTHS

COUNTED = ("activations", "late", "skipped", "lateness_ns", "steps", "bus_ns", "cpu_ns")
"""Of a span: what its counters grew by. `lateness_ns` is the sum over all its activations."""


class Span(Struct, frozen=True):
    """One span of a run; instants and times in ns."""

    begin_ns: int
    width_ns: int
    activations: int
    late: int
    skipped: int
    lateness_ns: int
    """Sum over the activations; by `activations` it is their mean."""
    steps: int
    bus_ns: int
    """Time on the wire, all buses together."""
    cpu_ns: int
    """Processor time of the process; 0 in virtual time."""
    lateness_max_ns: int
    step_max_ns: int


class Lately(Struct, frozen=True):
    """What became of the activations of the last seconds, up to now; instants and times in ns."""

    begin_ns: int
    activations: int
    late: int
    skipped: int
    lateness_max_ns: int


class Timeline:
    """The writing end. `counters` reads the run's counters, in the order of `COUNTED`.

    The caller raises `lateness_max` and `step_max`, and calls `close` before it counts a step that
    ended at `closes_at` or later.
    """

    def __init__(self, cells: Cells, counters: Callable[[], Sequence[int]]) -> None:
        self.lateness_max = 0
        self.step_max = 0
        self.closes_at = SECOND
        self._counters = counters
        before = list(counters())
        self._levels = [
            _Level(cells[level * _LEVEL_CELLS : (level + 1) * _LEVEL_CELLS], width, before)
            for level, width in enumerate(WIDTHS)
        ]

    def close(self, now: int) -> None:
        """Write the spans under way, and begin those that `now` lies in."""
        counters = self._counters()
        maxima = self.lateness_max, self.step_max
        for level in self._levels:
            level.close(now, counters, maxima)
        self.lateness_max = self.step_max = 0
        self.closes_at = self._levels[0].begin + SECOND

    def lately(self, since: int) -> Lately:
        """The spans of a second that end after `since`, and the one under way, together."""
        under_way = self._levels[0]
        first = max(since, 0) // SECOND * SECOND
        spans = [*filter(None, map(under_way.kept, range(first, under_way.begin, SECOND)))]
        activations, late, skipped, *_ = under_way.grown(self._counters())
        return Lately(
            spans[0].begin_ns if spans else under_way.begin,
            activations + sum(each.activations for each in spans),
            late + sum(each.late for each in spans),
            skipped + sum(each.skipped for each in spans),
            max([self.lateness_max, *(each.lateness_max_ns for each in spans)]),
        )


class _Level:
    """One ring of spans."""

    def __init__(self, cells: Cells, width: int, counters: Sequence[int]) -> None:
        self.begin = 0
        self._cells = cells
        self._width = width
        self._before = list(counters)
        self._maxima = [0, 0]

    def close(self, now: int, counters: Sequence[int], maxima: Sequence[int]) -> None:
        """Write the span under way; if `now` lies behind it, begin the one that it lies in."""
        grown = self.grown(counters)
        self._maxima = [max(pair) for pair in zip(self._maxima, maxima, strict=True)]
        slot = self._slot(self.begin)
        for cell, value in enumerate((self.begin, 1, *grown, *self._maxima), slot):
            self._cells[cell] = value
        if now >= self.begin + self._width:
            self.begin = now // self._width * self._width
            self._before = list(counters)
            self._maxima = [0, 0]

    def kept(self, begin: int) -> Span | None:
        """The span that began then; None if it was passed over, or its slot is another's by now."""
        slot = self._slot(begin)
        written_begin, used, *values = self._cells[slot : slot + len(SLOT)]
        return Span(begin, self._width, *values) if used and written_begin == begin else None

    def grown(self, counters: Sequence[int]) -> list[int]:
        """What the counters have grown by in the span under way."""
        return [after - before for after, before in zip(counters, self._before, strict=True)]

    def _slot(self, begin: int) -> int:
        """First cell of a span's slot."""
        return begin // self._width % SLOTS * len(SLOT)


_LEVEL_CELLS = SLOTS * len(SLOT)


def read_timeline(cells: Cells) -> list[Span]:
    """The spans in a file, oldest first, without overlap: each time as finely as it is kept."""
    spans: list[Span] = []
    for level, width in enumerate(WIDTHS):
        ring = _read_ring(cells[level * _LEVEL_CELLS : (level + 1) * _LEVEL_CELLS], width)
        if spans:
            finer_from = -(-spans[0].begin_ns // width) * width
            spans = [span for span in spans if span.begin_ns >= finer_from]
            ring = [span for span in ring if span.begin_ns < finer_from]
        spans = ring + spans
    return spans


def _read_ring(cells: Cells, width: int) -> list[Span]:
    """The spans of one level; one that was passed over when its turn came is left out."""
    slots = [cells[first : first + len(SLOT)] for first in range(0, len(cells), len(SLOT))]
    found = sorted(((begin, values) for begin, used, *values in slots if used), key=_begin)
    oldest = found[-1][0] - SLOTS * width if found else 0
    return [Span(begin, width, *values) for begin, values in found if begin > oldest]


def _begin(slot: tuple[int, list[int]]) -> int:
    return slot[0]
