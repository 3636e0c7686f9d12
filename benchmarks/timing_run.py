"""One run of the executive with an empty periodic model: `python -m benchmarks.timing_run JSON`.

The argument is a `timing_contestants.Task`. What it prints becomes a `Taken` there: lateness by
bucket, periods skipped, processor time, settings granted.
"""

import json
import sys
from time import process_time
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.loop import Executive
from firmware_runtime.executive.process import ProcessSettings


class Empty(Atomic):
    """Is activated, period after period, and does nothing."""

    def __init__(self, period: int) -> None:
        super().__init__("empty")
        self.period = period

    def initialize(self) -> None:
        """Begin after one period, when everything is warm."""
        self.hold_in("waiting", self.period)

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
    executive = Executive(Empty(asked["period_ns"]), MonotonicClock(), list, configuration)
    before = process_time()
    executive.run(seconds(asked["seconds"]))
    cpu_s = process_time() - before
    counted = executive.statistics.as_json()
    lateness = executive.statistics.lateness()
    return {
        "buckets": lateness.buckets.tolist(),
        "largest": lateness.largest,
        "skipped": counted["skipped"],
        "cpu_s": cpu_s,
        "settings": counted["conditions"]["settings"],
    }


if __name__ == "__main__":
    print(json.dumps(run(json.loads(sys.argv[1]))))
