"""Counters of one end of a link, and the report of what its carrier has counted."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

import msgspec
from msgspec import structs

from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.wire import Frame, Kind, encode, encoded, reading
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import LINK
from firmware_runtime.statistics.rows import LinkRow


class Carried(msgspec.Struct):
    """Counters of a carrier: datagrams since it was started."""

    refused: dict[Reason, int] = {}
    dropped: int = 0
    """Those that came faster than the run takes them."""
    unsent: int = 0
    """Those for which there was no room, no way, or no receiver yet."""


@dataclass(slots=True)
class Counts:
    """Values and frames since the start of the run."""

    sent: int = 0
    """Values that were sent, each once."""
    repeated: int = 0
    """Values that were sent again, because they had not arrived."""
    received: int = 0
    """Values that entered the model."""
    dropped: int = 0
    """Values that arrived, and in whose place a newer one of their port was taken."""
    overtaken: int = 0
    """Values that arrived after a newer one of their port."""
    given_up: int = 0
    """Values that left for an end that was there, and were never sent, or were given up."""
    unconnected: int = 0
    """Values that left while no other end was there, and were never sent."""
    unsent: int = 0
    """Frames for which there was no room, or no other end."""
    own: Counter[Reason] = field(default_factory=Counter)
    """What the run itself has refused."""
    carried: Carried = field(default_factory=Carried)
    """What the carrier has counted by its last report."""

    def row(self, *, is_good: bool, silences: int) -> tuple[int, ...]:
        """Return the counters as the statistics of the run have them."""
        return structs.astuple(
            LinkRow(
                is_good,
                self.sent,
                self.repeated,
                self.received,
                self.dropped + self.carried.dropped,
                self.overtaken,
                self.given_up,
                self.unconnected,
                self.unsent + self.carried.unsent,
                silences,
                *self.refused.values(),
            )
        )

    @property
    def refused(self) -> dict[Reason, int]:
        """Return all refusals, by every reason there is."""
        return {each: self.own[each] + self.carried.refused.get(each, 0) for each in Reason}


report_of: Final = reading(Carried)


def report(carried: Carried) -> bytes:
    """A carrier's frame to its run."""
    return encoded(Frame(Kind.REPORT, 1, 0, 1, 0, body=encode(carried)))


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
