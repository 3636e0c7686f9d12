"""What another process can do to a loop: take its processor, its quota, or stop or move it.

Each gives the windows in which it was done, CLOCK_MONOTONIC, ns. It runs at a priority above all of
them, so that it does what it does when it means to.
"""

import os
import random
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic_ns, sleep
from typing import NamedTuple

from benchmarks.blame.causes import LONGEST_MS, SHORTEST_MS, SPACING_S
from benchmarks.blame.quota import PERIOD_US, put_beside
from benchmarks.blame.victim import PRIORITY

Window = tuple[int, int]
_ABOVE = PRIORITY + 20


class Neighbour:
    """A process beside the victim, busy on request."""

    def __init__(self, work: str, cpu: int, priority: int, statistics: Path) -> None:
        command = [sys.executable, "-m", "benchmarks.blame.neighbour", work]
        command += [str(cpu), str(priority), str(statistics)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.wait()

    def begin(self, ms: float) -> None:
        """Let it be busy for so long."""
        assert self.process.stdin is not None  # noqa: S101 -- a pipe was asked for
        print(f"{ms:.3f}", file=self.process.stdin, flush=True)

    def wait(self) -> None:
        """Wait until it has done what was requested."""
        assert self.process.stdout is not None  # noqa: S101 -- a pipe was asked for
        self.process.stdout.readline()

    def close(self) -> None:
        """Let it end."""
        self.process.communicate()


class Target(NamedTuple):
    """The process to make late, which runs on the first of the processors, and its statistics."""

    victim: int
    cpus: tuple[int, ...]
    statistics: Path


def inject(cause: str, times: int, target: Target, rng: random.Random) -> list[Window]:
    """Do it so many times."""
    with _at_priority():
        return _INJECTIONS[cause](times, target, rng)


def _span_ms(rng: random.Random) -> float:
    return rng.uniform(SHORTEST_MS, LONGEST_MS)


def _pause(rng: random.Random) -> None:
    """Until the next, at any phase of the victim's period."""
    sleep(SPACING_S + rng.uniform(0, 0.01))


def _hogs(work: str, priority: int) -> Callable[..., list[Window]]:
    def run(times: int, target: Target, rng: random.Random) -> list[Window]:
        windows = []
        with _neighbour(work, target, 0, priority) as hog:
            for _ in range(times):
                began = monotonic_ns()
                hog.begin(_span_ms(rng))
                hog.wait()
                windows.append((began, monotonic_ns()))
                _pause(rng)
        return windows

    return run


def _quota(times: int, target: Target, rng: random.Random) -> list[Window]:
    """Something else in the victim's group, elsewhere, uses up what both have in a period."""
    windows = []
    with _neighbour("compute", target, -1, 0) as hog:
        put_beside(hog.process.pid, target.victim)
        for _ in range(times):
            began = monotonic_ns()
            hog.begin(PERIOD_US / 1000 + _span_ms(rng))
            hog.wait()
            windows.append((began, monotonic_ns() + PERIOD_US * 1000))
            sleep(PERIOD_US / 1e6 + SPACING_S)
    return windows


def _stop(times: int, target: Target, rng: random.Random) -> list[Window]:
    windows = []
    for _ in range(times):
        began = monotonic_ns()
        os.kill(target.victim, signal.SIGSTOP)
        sleep(_span_ms(rng) / 1000)
        os.kill(target.victim, signal.SIGCONT)
        windows.append((began, monotonic_ns()))
        _pause(rng)
    return windows


def _move(times: int, target: Target, rng: random.Random) -> list[Window]:
    """To the other processor and back, each time to one that is busy at a higher priority."""
    windows = []
    with (
        _neighbour("compute", target, 0, PRIORITY + 10) as first,
        _neighbour("compute", target, 1, PRIORITY + 10) as second,
    ):
        there = ((target.cpus[1], second), (target.cpus[0], first))
        for number in range(times):
            cpu, hog = there[number % 2]
            began = monotonic_ns()
            hog.begin(_span_ms(rng))
            os.sched_setaffinity(target.victim, {cpu})
            hog.wait()
            windows.append((began, monotonic_ns()))
            _pause(rng)
    return windows


_INJECTIONS: dict[str, Callable[..., list[Window]]] = {
    "hog-equal": _hogs("compute", PRIORITY),
    "hog-higher": _hogs("compute", PRIORITY + 10),
    "reader": _hogs("read", PRIORITY),
    "quota": _quota,
    "stop": _stop,
    "move": _move,
}


@contextmanager
def _neighbour(work: str, target: Target, cpu: int, priority: int) -> Iterator[Neighbour]:
    """On one of the target's processors, by its place among them."""
    neighbour = Neighbour(work, target.cpus[cpu], priority, target.statistics)
    try:
        yield neighbour
    finally:
        neighbour.close()


@contextmanager
def _at_priority() -> Iterator[None]:
    """Come before all of them within the block; children do not inherit it."""
    flags = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    os.sched_setscheduler(0, flags, os.sched_param(_ABOVE))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
