"""A run in steady state leaves nothing behind: what tracemalloc finds after thousands of ticks."""

import gc
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import HasDescriptor, MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.process import ProcessSettings

WARM_UP, TICKS = 2_000, 8_000
NOT_OURS = [
    tracemalloc.Filter(inclusive=False, filename_pattern=name)
    for name in (tracemalloc.__file__, __file__)
]
S = TypeVar("S", bound=HasDescriptor)


class Ticker(Atomic):
    def initialize(self) -> None:
        self.hold_in("waiting", 10 * MILLISECOND)

    def internal(self) -> None:
        self.hold_in("waiting", 10 * MILLISECOND)


class SnapshotClock(MonotonicClock):
    """Real time of which each wait is over at once; takes a snapshot before two of them."""

    def __init__(self) -> None:
        super().__init__()
        self.snapshots: list[tracemalloc.Snapshot] = []
        self.when_done: Callable[[], None] = lambda: None
        self._waits = 0

    def wait(self, until: int, _sources: Sequence[S]) -> list[S]:
        if self._waits in (WARM_UP, WARM_UP + TICKS):
            gc.collect()
            self.snapshots.append(tracemalloc.take_snapshot().filter_traces(NOT_OURS))
            if len(self.snapshots) == 2:
                self.when_done()
        self._waits += 1
        self.start(until)
        return []


@pytest.mark.slow
def test_ticks_leave_nothing_behind(tmp_path: Path) -> None:
    root = Coupled("root")
    for number in range(4):
        root.add(Ticker(f"ticker_{number}"))
    clock = SnapshotClock()
    configuration = Configuration(
        process=ProcessSettings(freeze_garbage=True), statistics_path=tmp_path / "tickers.stats"
    )
    executive = Executive(root, clock, list, configuration)
    clock.when_done = lambda: executive.request_stop("enough")
    tracemalloc.start()
    try:
        executive.run(NEVER)  # a busy machine skips periods: the ticks that ran count
    finally:
        tracemalloc.stop()
    before, after = clock.snapshots
    grown = after.compare_to(before, "lineno")
    # It keeps a reading of the kernel's counters of some 2 kB now and then.
    assert sum(each.size_diff for each in grown) < TICKS, grown[:8]
