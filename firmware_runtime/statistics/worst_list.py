"""The worst activations of a run, with what each spent its time on, in fixed places of the file.

How bad an activation was is its lateness plus the time of its step. A new one takes the place of
the least bad one. At most one of an instant is kept, the latest: its neighbours share its causes.
"""

from collections.abc import Iterator, Sequence

from firmware_runtime.statistics.blame import read_blame
from firmware_runtime.statistics.figures import Causes, WorstActivation
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import DEVICES, WORST, Layout
from firmware_runtime.statistics.rows import WorstRow, read_row

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
    """Where the time went; `spent` has the own times, then the devices of each bus."""
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
    """Of one bus, the time on the wire of each device, us."""
    return {
        f"0x{address:02x}": spent / 1000
        for address, spent in zip(cells[:DEVICES], cells[DEVICES:], strict=True)
        if spent > 0
    }
