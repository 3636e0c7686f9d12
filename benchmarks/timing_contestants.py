"""Who is measured in `bench timing`: cyclictest, and the executive without and with a spin.

Every sample is how late a wake-up was, in ns. cyclictest takes it when its thread is awake again;
the executive when the model's output function begins, after all that it does between waking and
that, so its figures contain its own work.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from benchmarks.side_by_side import PROJECT
from firmware_runtime.telemetry.histogram import upper_edge

CYCLICTEST = "cyclictest"
LONGEST_NS = 1_000_000
"""The longest histogram cyclictest takes, in buckets of 1 ns."""


@dataclass(frozen=True, slots=True)
class Task:
    """What a contestant does, once."""

    period_ns: int
    seconds: float
    priority: int
    spin_us: float

    @property
    def cycles(self) -> int:
        """Periods in that time."""
        return int(self.seconds * 1_000_000_000) // self.period_ns


@dataclass(frozen=True, slots=True)
class Taken:
    """One run: (lateness in ns, how many) in rising order, the largest, share of a processor."""

    samples: Sequence[tuple[int, int]]
    largest: int
    cpu: float
    settings: dict[str, Any]

    @property
    def count(self) -> int:
        """How many samples there are."""
        return sum(number for _, number in self.samples)

    def percentile(self, thousandths: int) -> int:
        """The least lateness that at least so many thousandths of the samples do not pass, ns."""
        rank = max(-(-self.count * thousandths // 1000), 1)
        counted = 0
        for lateness, number in self.samples:
            counted += number
            if counted >= rank:
                return min(lateness, self.largest)
        return self.largest


Contestant: TypeAlias = Callable[[Task], Taken]


def is_installed() -> bool:
    """Whether cyclictest is there."""
    return shutil.which(CYCLICTEST) is not None


def cyclictest(task: Task) -> Taken:
    """Run cyclictest: one thread, absolute clock_nanosleep, memory locked, cpu_dma_latency at 0."""
    with tempfile.TemporaryDirectory(prefix="timing-") as directory:
        report = Path(directory, "report.json")
        command = [CYCLICTEST, "--quiet", "--nsecs", "--mlockall", f"--json={report}"]
        command += [f"--interval={task.period_ns // 1000}", f"--loops={task.cycles}"]
        command += [f"--histogram={LONGEST_NS}"]
        command += [f"--priority={task.priority}"] if task.priority > 0 else ["--policy=other"]
        before = os.times()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        after = os.times()
        cpu_s = sum(after[2:4]) - sum(before[2:4])
        return from_cyclictest(json.loads(report.read_text()), cpu_s / task.seconds)


def from_cyclictest(report: dict[str, Any], cpu: float) -> Taken:
    """What cyclictest's JSON says; samples beyond its histogram count as the largest."""
    thread = report["thread"]["0"]
    unit = 1 if report["resolution_in_ns"] else 1000
    samples = sorted((int(late) * unit, count) for late, count in thread["histogram"].items())
    beyond = thread["cycles"] - sum(count for _, count in samples)
    largest = thread["max"] * unit
    return Taken([*samples, (largest, beyond)] if beyond > 0 else samples, largest, cpu, {})


def executive(task: Task) -> Taken:
    """Run the executive, in a process of its own."""
    asked = {
        "period_ns": task.period_ns,
        "seconds": task.seconds,
        "priority": task.priority,
        "spin_us": task.spin_us,
    }
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.timing_run", json.dumps(asked)],
        cwd=PROJECT,
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    answer = json.loads(done.stdout)
    samples = [
        (upper_edge(bucket), count) for bucket, count in enumerate(answer["buckets"]) if count > 0
    ]
    return Taken(samples, answer["largest"], answer["cpu_s"] / task.seconds, answer["settings"])
