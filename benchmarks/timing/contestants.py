"""Who is measured in `bench timing`: cyclictest, and the executive without and with a spin.

Every sample is how late a wake-up was, in ns. cyclictest takes it when its thread is awake again;
the executive when its step begins, after what the loop does between waking and that, and to the
upper edge of a bucket 3 % wide. Where the model's output function began is seen apart, by the model
itself. Processor time is that of the run: what an empty run takes, to start and to print its
histogram, is taken off cyclictest's.
"""

import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from benchmarks.shared.side_by_side import answer_of
from firmware_runtime.statistics.histogram import upper_edge

CYCLICTEST = "cyclictest"
LONGEST_NS = 1_000_000
"""The longest histogram cyclictest takes, in buckets of 1 ns."""


@dataclass(frozen=True, slots=True)
class Task:
    """What a contestant does, once; with priority 0 it has SCHED_OTHER."""

    period_ns: int
    seconds: float
    priority: int = 0
    spin_us: float = 0.0
    keep_awake: bool = True
    """Hold /dev/cpu_dma_latency at 0 meanwhile."""

    @property
    def cycles(self) -> int:
        """Periods in that time."""
        return int(self.seconds * 1_000_000_000) // self.period_ns


@dataclass(frozen=True, slots=True)
class Lateness:
    """Samples of one run: (lateness in ns, how many) in rising order, and the largest one."""

    samples: Sequence[tuple[int, int]]
    largest: int

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


@dataclass(frozen=True, slots=True)
class Taken:
    """What one run took: its lateness, and the share of a processor."""

    lateness: Lateness
    cpu: float
    output: Lateness | None = None
    """Until the model's output function has begun; None for a contestant without a model."""
    settings: Mapping[str, Any] = field(default_factory=dict)
    """Settings that the executive requested from the system, and got."""
    skipped: int | None = None
    """Periods that passed while it was late; None where they are not counted."""


def is_installed() -> bool:
    """Whether cyclictest is there."""
    return shutil.which(CYCLICTEST) is not None


def cyclictest(task: Task) -> Taken:
    """Run cyclictest: one thread, absolute clock_nanosleep, memory locked."""
    with tempfile.TemporaryDirectory(prefix="timing-") as directory:
        path = Path(directory, "report.json")
        empty_s = _run_cyclictest(replace(task, seconds=task.period_ns / 1e9), path)
        cpu_s = _run_cyclictest(task, path) - empty_s
        return from_cyclictest(json.loads(path.read_text()), max(cpu_s, 0.0) / task.seconds)


def _run_cyclictest(task: Task, path: Path) -> float:
    """Run it once; its report is in the file, its processor time is returned.

    Raises OSError with what it says when it fails.
    """
    command = [CYCLICTEST, "--quiet", "--nsecs", "--mlockall", f"--json={path}"]
    command += [f"--interval={task.period_ns // 1000}", f"--loops={task.cycles}"]
    command += [f"--histogram={LONGEST_NS}"]
    command += [f"--priority={task.priority}"] if task.priority > 0 else ["--policy=other"]
    command += [] if task.keep_awake else ["--default-system"]
    before = os.times()
    done = subprocess.run(
        command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    after = os.times()
    if done.returncode != 0:
        raise OSError(f"{CYCLICTEST} ended with {done.returncode}: {done.stderr.strip()}")
    return sum(after[2:4]) - sum(before[2:4])


def from_cyclictest(report: Mapping[str, Any], cpu: float) -> Taken:
    """What cyclictest's JSON says; samples beyond its histogram count as the largest."""
    thread = report["thread"]["0"]
    unit = 1 if report["resolution_in_ns"] else 1000
    samples = sorted((int(late) * unit, count) for late, count in thread["histogram"].items())
    beyond = thread["cycles"] - sum(count for _, count in samples)
    largest = thread["max"] * unit
    lateness = Lateness([*samples, (largest, beyond)] if beyond > 0 else samples, largest)
    return Taken(lateness, cpu)


def executive(task: Task) -> Taken:
    """Run the executive, in a process of its own."""
    answer = answer_of("benchmarks.timing.run", json.dumps(asdict(task)))
    return Taken(
        _lateness(answer["lateness"]),
        answer["cpu_s"] / task.seconds,
        _lateness(answer["output"]),
        answer["settings"],
        answer["skipped"],
    )


def _lateness(answer: Mapping[str, Any]) -> Lateness:
    filled = enumerate(answer["buckets"])
    samples = [(upper_edge(bucket), count) for bucket, count in filled if count > 0]
    return Lateness(samples, answer["largest"])
