"""One cause, injected so many times into a victim of its own: what the statistics called each."""

import json
import os
import random
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from subprocess import PIPE
from time import monotonic, sleep

from benchmarks.blame.causes import INJECTED, PERIOD_MS, WARM_UP_S
from benchmarks.blame.outside import Target, Window, inject
from benchmarks.blame.quota import limited
from benchmarks.blame.victim import EVERY, FIRST
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.statistics.errors import StatisticsFileError
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, STEPS
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

_BEGINS_S = 30.0


class TrialError(FirmwareRuntimeError):
    """The victim did not run."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One cause: how often, and where the victim runs and keeps its statistics."""

    cause: str
    times: int
    seed: int
    cpus: tuple[int, ...]
    folder: Path

    @property
    def statistics(self) -> Path:
        """Of the victim."""
        return self.folder / f"{self.cause}.stats"

    def run(self) -> list[WorstActivation | None]:
        """What each injection was put down to, as `verdicts` has it.

        Raises OSError and NoQuotaError where it cannot be injected, TrialError if nothing ran.
        """
        if self.cause == "move" and len(self.cpus) < 2:
            raise TrialError("there is one processor, and it takes two")
        command = [sys.executable, "-m", "benchmarks.blame.victim", self.cause, str(self.times)]
        command += [str(self.seed), str(self.cpus[0]), str(self.statistics)]
        with ExitStack() as ends:
            victim = subprocess.Popen(command, stdin=PIPE, stdout=PIPE, stderr=PIPE, text=True)
            if self.cause == "quota":
                ends.enter_context(_ended(victim))
                ends.enter_context(limited(victim.pid))
            ends.enter_context(_ended(victim))
            windows = self._injected(victim)
        return verdicts(read_statistics(self.statistics), windows)

    def _injected(self, victim: "subprocess.Popen[str]") -> list[Window]:
        """Let the victim run, do it, and let the run end; when it was done."""
        assert victim.stdout is not None  # noqa: S101 -- pipes were asked for
        assert victim.stdin is not None  # noqa: S101
        victim.stdout.readline()
        print("go", file=victim.stdin, flush=True)
        _await_steps(victim, self.statistics)
        windows: list[Window] = []
        if INJECTED[self.cause].from_within:
            last = FIRST + EVERY * (self.times + 2)
            while victim.poll() is None and _ticks(self.statistics) < last:
                sleep(0.1)
        else:
            sleep(WARM_UP_S)
            rng = random.Random(self.seed)  # noqa: S311 -- spans and phases are no secret
            target = Target(victim.pid, self.cpus, self.statistics)
            windows = inject(self.cause, self.times, target, rng)
        victim.terminate()
        said, complaint = victim.communicate(timeout=_BEGINS_S)
        if victim.returncode != 0:
            raise TrialError(f"{self.cause}: the victim failed: {complaint.strip()}")
        return windows or [(begin, end) for begin, end in json.loads(said.splitlines()[-1])]


@contextmanager
def _ended(victim: "subprocess.Popen[str]") -> Iterator[None]:
    """The victim does not outlive the block, stopped or not."""
    try:
        yield
    finally:
        if victim.poll() is None:
            victim.kill()
            victim.communicate()


def _ticks(statistics: Path) -> int:
    return read_statistics(statistics).cells[ELAPSED] // (PERIOD_MS * MILLISECOND)


def _await_steps(victim: "subprocess.Popen[str]", statistics: Path) -> None:
    give_up_at = monotonic() + _BEGINS_S
    while monotonic() < give_up_at and victim.poll() is None:
        try:
            if read_statistics(statistics).cells[STEPS] > 0:
                return
        except StatisticsFileError:
            pass  # not there yet
        sleep(0.05)
    raise TrialError(f"{statistics}: the victim did not begin: {victim.communicate()[1].strip()}")


def verdicts(statistics: Statistics, windows: Sequence[Window]) -> list[WorstActivation | None]:
    """The latest activation of each window, which has a verdict; None where none was late."""
    began = statistics.cells[HEARTBEAT] - statistics.cells[ELAPSED]
    worst = [each for each in statistics.figures().worst if each.blame is not None]
    return [
        max(
            (each for each in worst if _meets(each, begin - began, end - began)),
            key=_of_us,
            default=None,
        )
        for begin, end in windows
    ]


def _meets(activation: WorstActivation, begin: int, end: int) -> bool:
    """Whether the activation's time, from its deadline on, meets the window, ns of the run."""
    span = round((activation.lateness_us + activation.step_us) * 1000)
    return activation.t_ns <= end and activation.t_ns + span >= begin


def _of_us(activation: WorstActivation) -> float:
    return 0.0 if activation.blame is None else activation.blame.of_us


def processors() -> tuple[int, ...]:
    """Those that may be used, the last first: the first has most of the interrupts."""
    return tuple(sorted(os.sched_getaffinity(0), reverse=True))
