"""History of a run in fixed memory: how it went over time, and its worst activations.

Timeline: the last two minutes by the second, before that coarsely. Every level is a ring of `SLOTS`
spans of one width. The writer keeps two maxima for a step, nothing else: once a second it writes,
at every level, what the counters have grown by since the span under way began. What is not written
yet is lost when a process is killed; the counters are not.

Worst activations: how bad one was is its lateness plus the time of its step. A new one takes the
place of the least bad one. At most one of an instant is kept, the latest: its neighbours share its
causes.
"""

from collections.abc import Callable, Iterator, Sequence

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.blame import read_blame
from firmware_runtime.statistics.figures import Causes, WorstActivation
from firmware_runtime.statistics.histogram import LARGEST_SUM, Cells
from firmware_runtime.statistics.layout import DEVICES, SLOT, SLOTS, WIDTHS, WORST, Layout
from firmware_runtime.statistics.rows import WorstRow, read_row

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
    """Outcomes of the activations of the last seconds, up to now; instants and times in ns."""

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
            self._cells[cell] = min(value, LARGEST_SUM)
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
        """Return what the counters have grown by in the span under way."""
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


_LATENESS, _STEP = WORST.index("lateness_ns"), WORST.index("step_ns")


class WorstList:
    """The writing end of the list; a newcomer must be worse than `smallest`."""

    def __init__(self, cells: Cells, layout: Layout) -> None:
        self.smallest = 0
        self._badness = [0] * layout.worst
        self._places = [
            cells[layout.place(index) : layout.place(index + 1)] for index in range(layout.worst)
        ]

    def keep(self, row: Sequence[int]) -> None:
        """Write one activation: the values of `WORST`, own times, devices, as laid out."""
        index = self._badness.index(self.smallest)
        place = self._places[index]
        for cell, value in enumerate(row):
            place[cell] = value
        self._badness[index] = row[_LATENESS] + row[_STEP]
        self.smallest = min(self._badness)


def read_worst(cells: Cells, layout: Layout) -> list[WorstActivation]:
    """The list as it stands in a file, the worst first."""
    places = (_activation(cells, layout, index) for index in range(layout.worst))
    return sorted((each for each in places if _badness(each) > 0), key=_badness, reverse=True)


def late_activations(cells: Cells, layout: Layout) -> Iterator[tuple[str, WorstRow]]:
    """Those in the list that were late, in no order, with the path of their model."""
    for index in range(layout.worst if layout.models else 0):
        row = read_row(WorstRow, cells, layout.place(index))
        if row.lateness_ns > 0:
            yield layout.models[row.model], row


def _badness(activation: WorstActivation) -> float:
    return activation.lateness_us + activation.step_us


def _activation(cells: Cells, layout: Layout, index: int) -> WorstActivation:
    first = layout.place(index)
    row = read_row(WorstRow, cells, first)
    blame = read_blame(cells[layout.blame_of(index)], layout)
    return WorstActivation(
        t_ns=row.t_ns,
        model=layout.models[row.model] if layout.models else None,
        lateness_us=row.lateness_ns / 1000,
        step_us=row.step_ns / 1000,
        causes=_causes(row, layout, cells[first + len(WORST) : first + layout.place_cells]),
        blame=blame,
    )


def _causes(row: WorstRow, layout: Layout, spent: Cells) -> Causes:
    """Return where the time went; `spent` has the own times, then the devices of each bus."""
    devices, timed = 2 * DEVICES, len(layout.timed)
    own_times = zip(layout.timed, spent, strict=False)  # what follows them are devices
    return Causes(
        wake_us=row.wake_ns / 1000,
        behind_us=row.behind_ns / 1000,
        garbage_us=row.garbage_ns / 1000,
        bus_us={
            bus: _by_address(spent[timed + number * devices : timed + (number + 1) * devices])
            for number, bus in enumerate(layout.buses)
        },
        models_us={path: own_time / 1000 for path, own_time in own_times if own_time > 0},
    )


def _by_address(cells: Cells) -> dict[str, float]:
    """Return the time on the wire of each device of a bus, in us."""
    return {
        f"0x{address:02x}": spent / 1000
        for address, spent in zip(cells[:DEVICES], cells[DEVICES:], strict=True)
        if spent > 0
    }
