"""Watch for new lateness of a run, by comparing copies of its statistics.

What was counted when the watch began is not new. A late activation is noticed when it comes among
the worst, when a model's largest lateness grows, or when it falls into a bucket of the histogram
that lies wholly over the limit: one that is over it by less than 3.1 % may pass unseen.
"""

from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Final

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.errors import BeingWrittenError
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import LARGEST, Histogram, bucket_of
from firmware_runtime.statistics.history import late_activations
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.number_formats import instant
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

LOOK_EVERY_S: Final = 0.1
AFTERMATH_S: Final = 0.5
"""How long it goes on after a late activation, so that what came of it is recorded too."""


class NothingHappened(Exception):
    """No activation was late; says why that is known."""


@dataclass(frozen=True, slots=True)
class Late:
    """A late activation: of which model, at which deadline in ns of the run, and how late.

    Where it is not `exact`, it was at least so late, and its deadline lay before `t_ns`.
    """

    model: str
    t_ns: int
    lateness_ns: int
    exact: bool = True

    def __str__(self) -> str:
        when, over = ("at", "") if self.exact else ("before", "over ")
        late = f"{over}{self.lateness_ns / 1e6:.2f} ms late"
        return f"{self.model} {when} {instant(self.t_ns)}, {late}"


@dataclass(frozen=True, slots=True)
class _Seen:
    """Lateness over the limit, as one copy shows it."""

    worst: frozenset[Late] = frozenset()
    samples: tuple[int, ...] = ()
    """How many there are, by model, in buckets wholly over the limit."""
    largest: tuple[int, ...] = ()
    """By model, ns."""


class LateWatch:
    """Compares each copy of a run's statistics with the one before."""

    def __init__(self, limit_ns: int, statistics: Statistics) -> None:
        self._limit = limit_ns
        self._writer = statistics.header.writer
        self._seen = self._look(statistics)

    def new_in(self, statistics: Statistics) -> Late | None:
        """The earliest activation known that was later than the limit and had not been seen."""
        before, self._seen = self._seen, self._look(statistics)
        if statistics.header.writer != self._writer:  # another run has begun
            self._writer, before = statistics.header.writer, _Seen()
        fresh = self._seen.worst - before.worst
        if fresh:
            return min(fresh, key=lambda late: late.t_ns)
        return self._counted_since(before, statistics)

    def _counted_since(self, before: _Seen, statistics: Statistics) -> Late | None:
        """One that is not among the worst, so that less is known of it."""
        now, models = self._seen, statistics.layout.models
        elapsed = statistics.cells[ELAPSED]
        nothing = (0,) * len(models)
        samples, largest = before.samples or nothing, before.largest or nothing
        for index, model in enumerate(models):
            if now.largest[index] > max(self._limit, largest[index]):
                return Late(model, elapsed, now.largest[index], exact=False)
            if now.samples[index] > samples[index]:
                return Late(model, elapsed, self._limit, exact=False)
        return None

    def _look(self, statistics: Statistics) -> _Seen:
        models = range(len(statistics.layout.models))
        lateness = [
            Histogram(statistics.cells[statistics.layout.lateness(index)]) for index in models
        ]
        over = bucket_of(min(self._limit, LARGEST)) + 1
        return _Seen(
            self._worst(statistics),
            tuple(sum(each.buckets[over:]) for each in lateness),
            tuple(each.largest for each in lateness),
        )

    def _worst(self, statistics: Statistics) -> frozenset[Late]:
        late = late_activations(statistics.cells, statistics.layout)
        return frozenset(
            Late(path, row.t_ns, row.lateness_ns)
            for path, row in late
            if row.lateness_ns > self._limit
        )


def late_activation(kept: Path, limit_ns: int, longest_s: float) -> Late:
    """Wait until an activation of a run is later than the limit, and half a second more.

    Raises NothingHappened when the run ends before, or so many seconds have passed.
    """
    until = monotonic() + longest_s
    statistics = _read(kept, until)
    watch = LateWatch(limit_ns, statistics)
    limit = f"over {limit_ns / MICROSECOND:.10g} us late"
    while statistics.state is RunState.RUNNING and statistics.writer_alive:
        if monotonic() >= until:
            raise NothingHappened(f"no activation was {limit} within {longest_s:g} s")
        sleep(LOOK_EVERY_S)
        statistics = _read(kept, until)
        if late := watch.new_in(statistics):
            sleep(AFTERMATH_S)
            return late
    raise NothingHappened(f"the run is not under way, and no activation was {limit} meanwhile")


def _read(kept: Path, until: float) -> Statistics:
    """The statistics; of a run that is stopped half way through its counting, when it goes on.

    Raises BeingWrittenError if it has not up to an instant of `monotonic`.
    """
    while True:
        try:
            return read_statistics(kept)
        except BeingWrittenError:
            if monotonic() >= until:
                raise
