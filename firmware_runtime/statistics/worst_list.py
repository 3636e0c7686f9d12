"""The worst activations of a run, with what each spent its time on, in fixed places of the file.

How bad an activation was is its lateness plus the time of its step. A new one takes the place of
the least bad one. At most one of an instant is kept, the latest: its neighbours share its causes.
"""

from collections.abc import Sequence

from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import WORST, Layout

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
