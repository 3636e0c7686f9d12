"""Statistics of two moments of a run subtracted, and statistics of several runs added up.

Counters, histograms and their sums add and subtract exactly, cell by cell, because the buckets of
all histograms are the same. The timeline is left out. Two things do not subtract: of the largest
sample since a moment only the bucket is known, so its upper edge stands for it (at most 3.1 % too
high, and never more than the largest of all); and the worst activations are those that came after
the moment.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

from msgspec import structs
from msgspec.structs import replace

from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.fault_table import FaultCount
from firmware_runtime.statistics.file_header import Header, RunState
from firmware_runtime.statistics.histogram import (
    BUCKETS,
    CELLS,
    LARGEST_CELL,
    LARGEST_SUM,
    SUM_CELL,
    Cells,
    Histogram,
    empty_cells,
    upper_edge,
)
from firmware_runtime.statistics.layout import (
    CPU,
    ELAPSED,
    INPUTS_DROPPED,
    LINK,
    MODEL,
    STEP_HISTOGRAM,
    STEPS,
    TIMELINE,
    WORST,
    YIELDED,
    Layout,
)
from firmware_runtime.statistics.rows import LinkRow, ModelRow, counters
from firmware_runtime.statistics.statistics import NO_INSTANT, Statistics

_LAST_LATE, _DUE = MODEL.index("last_late_ns"), MODEL.index("due_ns")
_SCHEDULED, _SKIPPED = MODEL.index("scheduled"), MODEL.index("skipped")
_OUTCOMES = [MODEL.index(name) for name in ("run", "skipped", "coalesced")]
_LINK_COUNTERS = [LINK.index(name) for name in counters(LinkRow)]
_COUNTERS = [MODEL.index(name) for name in counters(ModelRow)]
_LATENESS, _STEP = WORST.index("lateness_ns"), WORST.index("step_ns")


def difference(later: Statistics, earlier: Statistics) -> Statistics:
    """Return what was counted between two readings of one run.

    Raises StatisticsFileError when they are not of one run, or not in this order.
    """
    if not same_run(later, earlier):
        raise StatisticsFileError("these statistics are of two runs", expected="two moments of one")
    layout = later.layout
    cells = _copy_of(later)
    for index in counting(layout):
        cells[index] = max(cells[index] - earlier.cells[index], 0)
    for index in range(len(layout.models)):
        first = layout.model(index)
        cells[first + _SCHEDULED] = sum(cells[first + outcome] for outcome in _OUTCOMES)
    for part in histograms(layout):
        _subtract(cells[part], earlier.cells[part])
    cells[layout.timeline] = empty_cells(TIMELINE)
    for model, (before, after) in enumerate(zip(_faults(earlier), _faults(later), strict=True)):
        fault_table.fill(cells[layout.faults], model, fault_table.since(before, after))
    known = set(map(bytes, _places(earlier)))
    _keep_worst(cells, layout, [each for each in _places(later) if bytes(each) not in known])
    return replace(later, cells=cells)


def same_run(later: Statistics, earlier: Statistics) -> bool:
    """Return whether both are of one run, `earlier` first."""
    return (
        later.header.writer == earlier.header.writer
        and later.layout == earlier.layout
        and all(later.cells[index] >= earlier.cells[index] for index in _certain(later.layout))
    )


def merged(runs: Sequence[Statistics]) -> Statistics:
    """Several runs as if they were one, which ended as the worst of them did.

    Conditions that differ read `differs`. When models were last late or reported faults, and the
    timeline, have no meaning here and are left out. Raises StatisticsFileError when the runs have
    not the same models, lines and deadlines, or count overruns by other periods, tolerances or
    policies.
    """
    _demand_alike(runs)
    runs = sorted(runs, key=_gravity, reverse=True)
    first = runs[0]
    layout = first.layout
    cells = _copy_of(first)
    cells[layout.timeline] = empty_cells(TIMELINE)
    cells[YIELDED] = max(run.cells[YIELDED] for run in runs)  # that one was must not be lost
    try:
        for run in runs[1:]:
            _add(cells, run)
    except ValueError as error:  # of a cell
        raise StatisticsFileError(
            "the sum of these runs is more than statistics hold", expected="runs of 146 years"
        ) from error
    for index in range(len(layout.models)):
        cells[layout.model(index) + _LAST_LATE] = NO_INSTANT
        cells[layout.model(index) + _DUE] = NEVER
    for model, counted in enumerate(zip(*map(_faults, runs), strict=True)):
        fault_table.fill(cells[layout.faults], model, fault_table.of_several_runs(counted))
    _keep_worst(cells, layout, [place for run in runs for place in _places(run)])
    complete = all(run.complete for run in runs)
    return replace(first, header=_merged_header(runs), cells=cells, complete=complete)


def differing_conditions(runs: Sequence[Statistics]) -> dict[str, list[Any]]:
    """The conditions in which runs differ, with the value of each; None where one has none."""
    tables = [run.header.conditions for run in runs]
    names = dict.fromkeys(name for table in tables for name in table)
    values = {name: [table.get(name) for table in tables] for name in names}
    return {name: each for name, each in values.items() if any(one != each[0] for one in each)}


# -------------------------------------------------------------------------------------------------


def _demand_alike(runs: Sequence[Statistics]) -> None:
    """Raise StatisticsFileError for runs that cannot be added up."""
    first = runs[0]
    if any(run.layout != first.layout for run in runs):
        raise StatisticsFileError(
            "these runs have different models, lines or deadlines", expected="runs of one board"
        )
    if any(run.header.models != first.header.models for run in runs):
        raise StatisticsFileError(
            "these runs have different periods, tolerances or policies of models",
            expected="runs with the same settings",
        )


def _add(cells: Cells, run: Statistics) -> None:
    """Add what counts up in a run."""
    for index in counting(run.layout):
        cells[index] += run.cells[index]
    for part in histograms(run.layout):
        Histogram(cells[part]).merge(Histogram(run.cells[part]))


def _copy_of(statistics: Statistics) -> Cells:
    return memoryview(bytearray(statistics.cells)).cast("q")


def _faults(statistics: Statistics) -> list[list[FaultCount]]:
    """The faults of each model that can report any."""
    block = statistics.cells[statistics.layout.faults]
    models = range(len(statistics.layout.fault_models))
    return [fault_table.read(block, model) for model in models]


def _certain(layout: Layout) -> set[int]:
    """Return where the counters are that the run itself wrote.

    How long it has lasted and what it has skipped a reader knows before the run has written it; a
    process that is gone then has not written it at all (`file_header.count_overdue`).
    """
    models = map(layout.model, range(len(layout.models)))
    known = {first + index for first in models for index in (_SCHEDULED, _SKIPPED)}
    return {*counting(layout)} - {ELAPSED, *known}


def counting(layout: Layout) -> Iterator[int]:
    """Return where all cells are that count up, histograms aside."""
    yield from (ELAPSED, STEPS, INPUTS_DROPPED, CPU)
    for index in range(len(layout.models)):
        yield from (layout.model(index) + counter for counter in _COUNTERS)
    yield from range(layout.bus(0), layout.bus(len(layout.buses)))
    yield from range(layout.deadline(0), layout.deadline(len(layout.deadlines)))
    yield from range(layout.port(0), layout.port(len(layout.ports)))
    if layout.has_link:
        yield from (layout.link + counter for counter in _LINK_COUNTERS)
    late = layout.late_by_cause
    yield from range(late.start, late.stop)


def histograms(layout: Layout) -> Iterator[slice]:
    """Return where the cells of each histogram are."""
    yield STEP_HISTOGRAM
    for index in range(len(layout.models)):
        yield layout.lateness(index)
        yield layout.step(index)
    if layout.has_link:
        yield layout.link_age
        yield layout.round_trip


def _subtract(cells: Cells, earlier: Cells) -> None:
    """Take an earlier state of a histogram from its cells."""
    largest, is_full = cells[LARGEST_CELL], cells[SUM_CELL] >= LARGEST_SUM
    for index in range(CELLS):
        cells[index] -= earlier[index]
    if is_full:
        cells[SUM_CELL] = LARGEST_SUM  # what it grew by is not known
    if largest > earlier[LARGEST_CELL]:
        cells[LARGEST_CELL] = largest
        return
    grown = [bucket for bucket in range(BUCKETS) if cells[bucket] > 0]
    cells[LARGEST_CELL] = min(upper_edge(grown[-1]), largest) if grown else 0


def _places(statistics: Statistics) -> list[Cells]:
    """The places of the list of the worst that are taken."""
    layout = statistics.layout
    ends = [layout.place(index) for index in range(layout.worst + 1)]
    places = [statistics.cells[first:end] for first, end in pairwise(ends)]
    return [place for place in places if _badness(place) > 0]


def _keep_worst(cells: Cells, layout: Layout, places: Sequence[Cells]) -> None:
    """Fill the list of the worst."""
    cells[layout.place(0) : layout.place(layout.worst)] = empty_cells(
        layout.worst * layout.place_cells
    )
    for index, place in enumerate(sorted(places, key=_badness, reverse=True)[: layout.worst]):
        cells[layout.place(index) : layout.place(index + 1)] = place


def _badness(place: Cells) -> int:
    return place[_LATENESS] + place[_STEP]


def _gravity(run: Statistics) -> int:
    """Return how bad a run's state is; that its process died without a word is the worst."""
    died = run.state is RunState.RUNNING and not run.writer_alive
    return len(RunState) if died else run.state


def _merged_header(runs: Sequence[Statistics]) -> Header:
    header = runs[0].header
    differing = differing_conditions(runs)
    conditions = {
        name: "differs" if name in differing else value
        for name, value in header.conditions.items()
        if name not in differing or not isinstance(value, dict)
    }
    return structs.replace(header, conditions=conditions)
