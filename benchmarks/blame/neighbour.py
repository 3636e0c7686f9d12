"""A process that takes its processor in bursts: by computing, or by reading statistics.

    python -m benchmarks.blame.neighbour compute|read CPU PRIORITY STATISTICS

For each line of standard input, a number of ms, it is busy for so long and then says so. A priority
of 0 is that of ordinary processes.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.statistics.reader import read_statistics


def main() -> None:
    """Serve bursts until standard input ends."""
    work, cpu, priority, statistics = sys.argv[1:5]
    os.sched_setaffinity(0, {int(cpu)})
    if int(priority) > 0:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(int(priority)))
    busy = _compute if work == "compute" else _reader(Path(statistics))
    print("ready", flush=True)
    for line in sys.stdin:
        until = monotonic_ns() + round(float(line) * MILLISECOND)
        while monotonic_ns() < until:
            busy()
        print("done", flush=True)


def _compute() -> None:
    for _ in range(100):
        pass


def _reader(statistics: Path) -> Callable[[], object]:
    return lambda: read_statistics(statistics)


if __name__ == "__main__":
    main()
