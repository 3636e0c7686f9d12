"""Whether the runtime's memory grows: tracemalloc over many ticks in steady state.

The loop as it is, on a clock whose waits are over at once, with a statistics file
and the collector of garbage; two snapshots are compared, each after a full collection.
"""

import gc
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from benchmarks.accounting.models import HastyClock, S, configuration, tickers
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.executive import Executive

MODELS = 4
WARM_UP = 2_000
SHOWN = 8
_PROJECT = f"{Path(__file__).parents[2]}/"
_NOT_OURS = (
    tracemalloc.Filter(inclusive=False, filename_pattern=tracemalloc.__file__),
    tracemalloc.Filter(inclusive=False, filename_pattern=__file__),
)


class SnapshotClock(HastyClock):
    """Takes a snapshot before the tick with each of these numbers; `enough` is called then."""

    def __init__(self, ticks: Sequence[int]) -> None:
        super().__init__()
        self.snapshots: list[tracemalloc.Snapshot] = []
        self.enough: Callable[[], None] = lambda: None
        self._ticks = ticks
        self._waits = 0

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Go to the deadline at once, or after a snapshot."""
        if self._waits in self._ticks:
            gc.collect()
            self.snapshots.append(tracemalloc.take_snapshot())
            if len(self.snapshots) == len(self._ticks):
                self.enough()
        self._waits += 1
        return super().wait(until, sources)


def measure(directory: Path, ticks: int) -> dict[str, Any]:
    """What is there after the ticks and was not there before, in bytes and by line."""
    clock = SnapshotClock((WARM_UP, WARM_UP + ticks))
    model = tickers(MODELS)
    executive = Executive(model, clock, list, configuration(directory))
    clock.enough = lambda: executive.request_stop("enough")
    tracemalloc.start()
    try:
        executive.run(NEVER)  # a busy machine skips periods: the ticks that ran count
    finally:
        tracemalloc.stop()
    found = growth(*clock.snapshots)
    return {"ticks": ticks, "models": MODELS, **found, "ratio": found["bytes"] / ticks}


def growth(before: tracemalloc.Snapshot, after: tracemalloc.Snapshot) -> dict[str, Any]:
    """What the second snapshot has more than the first; the lines that differ most."""
    earlier, later = (each.filter_traces(_NOT_OURS) for each in (before, after))
    grown = [each for each in later.compare_to(earlier, "lineno") if each.size_diff != 0]
    return {
        "bytes": sum(each.size_diff for each in grown),
        "objects": sum(each.count_diff for each in grown),
        "places": {
            str(each.traceback).removeprefix(_PROJECT): each.size_diff for each in grown[:SHOWN]
        },
    }


def text(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    return [
        f"Memory that {result['ticks']} ticks of {result['models']} models leave behind:",
        f"  {result['bytes']} bytes in {result['objects']} objects more, of them",
        *(f"    {size:+} bytes at {place}" for place, size in result["places"].items()),
        f"ratio {result['ratio']:.4f} (bytes a tick; goal 0)",
    ]
