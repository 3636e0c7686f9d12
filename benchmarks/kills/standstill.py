"""When the machine stood still: as seen on each processor by a process that nearly all wait for.

It sleeps for `EVERY_S` again and again under SCHED_FIFO, above a robot's loop, and notes each sleep
that lasted `NOTED` longer: of the kernel, or of what the machine is a guest of.

    python -m benchmarks.kills.standstill CPU FILE
"""

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from time import monotonic_ns, sleep
from typing import Final

from benchmarks.kills.killed import PRIORITY
from firmware_runtime.devs.time import MILLISECOND, SECOND

EVERY_S: Final = 0.005
NOTED: Final = 2 * MILLISECOND


class Standstills:
    """Watches every processor until the stack closes; knows nothing where that is not allowed."""

    def __init__(self, stack: ExitStack, directory: Path) -> None:
        self._logs: list[Path] = []
        for cpu in sorted(os.sched_getaffinity(0)):
            log = directory / f"standstill-{cpu}"
            words = [sys.executable, "-m", __name__, str(cpu), str(log)]
            process = subprocess.Popen(words, stderr=subprocess.DEVNULL)
            stack.callback(process.wait)
            stack.callback(process.kill)
            self._logs.append(log)

    def longest_ms(self, begin: int, end: int) -> float | None:
        """The longest standstill of a processor in a span, ms; None if nothing watched."""
        if not any(log.exists() for log in self._logs):
            return None
        found = [each for log in self._logs if log.exists() for each in _noted(log)]
        return (
            max((late for at, late in found if at <= end and at + late >= begin), default=0) / 1e6
        )


def _noted(log: Path) -> list[tuple[int, int]]:
    lines = log.read_text().rpartition("\n")[0].splitlines()
    return [(int(at), int(late)) for at, late in (line.split() for line in lines)]


def main(cpu: int, log: Path) -> None:
    """Note when this processor stood still, and for how many ns. Ends by being killed."""
    os.sched_setaffinity(0, {cpu})
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    period = round(EVERY_S * SECOND)
    with log.open("w", buffering=1) as file:
        while True:
            began = monotonic_ns()
            sleep(EVERY_S)
            late = monotonic_ns() - began - period
            if late >= NOTED:
                file.write(f"{began + period} {late}\n")


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))
