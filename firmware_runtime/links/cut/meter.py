"""What a link counts, in the statistics of its run."""

from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.cut.counts import Counts
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import LINK


class LinkMeter:
    """Writes into the cells of a run that has begun; each cell by itself, outside of sections."""

    def __init__(self, executive: Executive) -> None:
        layout, cells = executive.layout, executive.cells
        self._row = cells[layout.link : layout.link + len(LINK)]
        self._age = Histogram(cells[layout.link_age])
        self._round_trip = Histogram(cells[layout.round_trip])
        self._written: tuple[int, ...] = ()

    def write(self, counts: Counts, *, is_good: bool, silences: int) -> None:
        """Write what has changed."""
        row = counts.row(is_good=is_good, silences=silences)
        if row != self._written:
            self._written = row
            for index, number in enumerate(row):
                self._row[index] = number

    def note_age(self, age: int) -> None:
        """A value was so old when it arrived, ns."""
        self._age.record(age)

    def note_round_trip(self, round_trip: int) -> None:
        """A frame and the answer to it took so long together, ns."""
        self._round_trip.record(round_trip)
