"""One run of the executive with an empty periodic model: `python -m benchmarks.timing.run JSON`.

The argument is a `timing.contestants.Task`. What it prints becomes a `Taken` there: lateness by
bucket, as the run counts it and as the model sees it, periods skipped, processor time, settings
granted.
"""

import json
import sys
from collections.abc import Callable
from time import process_time
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.statistics.histogram import Histogram, empty_cells


class Empty(Atomic):
    """Is activated, period after period, and notes in `seen` how late its output function began."""

    def __init__(self, period: int, now: Callable[[], int]) -> None:
        super().__init__("empty")
        self.period = period
        self.seen = Histogram(empty_cells())
        self.model_now: Callable[[], int] = int
        self._now = now

    def initialize(self) -> None:
        """Begin after one period, when everything is warm."""
        self.hold_in("waiting", self.period)

    def output(self) -> None:
        """Look at the clock."""
        self.seen.record(self._now() - self.model_now())

    def internal(self) -> None:
        """Wait for the next."""
        self.hold_in("waiting", self.period)


def run(asked: dict[str, Any]) -> dict[str, Any]:
    """Run it; return lateness by bucket, and what it took."""
    configuration = Configuration(
        process=ProcessSettings(
            fifo_priority=asked["priority"],
            lock_memory=True,
            timer_slack_ns=1,
            freeze_garbage=True,
            spin_us=asked["spin_us"],
            keep_cpu_awake=asked["keep_awake"],
        )
    )
    clock = MonotonicClock()
    model = Empty(asked["period_ns"], clock.now)
    executive = Executive(model, clock, list, configuration)
    model.model_now = lambda: executive.simulator.now
    before = process_time()
    executive.run(seconds(asked["seconds"]))
    cpu_s = process_time() - before
    counted = executive.statistics.as_json()
    return {
        "lateness": _cells(executive.statistics.lateness()),
        "output": _cells(model.seen),
        "skipped": counted["skipped"],
        "cpu_s": cpu_s,
        "settings": counted["conditions"]["settings"],
    }


def _cells(histogram: Histogram) -> dict[str, Any]:
    return {"buckets": histogram.buckets.tolist(), "largest": histogram.largest}


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]))))
