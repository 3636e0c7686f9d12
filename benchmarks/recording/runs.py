"""One run of a board on its doubles, measured: with a recording, without one, or with a part of it.

In virtual time the clock waits for nothing, models' functions are timed as in real time, and each
reading of the clock is recorded as a real one's. Of each step it is noted how long it took until it
was counted, and how long from there until the loop waits for the next, so that of many equal runs
the least can be taken.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from time import monotonic_ns, perf_counter_ns, process_time_ns
from typing import Any
from unittest.mock import patch

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import MICROSECOND, seconds
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs import recorded_edge
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.layout import STEPS

BARE, RECORDED, OWN, AGAIN = "bare", "recorded", "own", "bare again"
"""Without a recording, with one, with one that leaves out the doubles' world; the first."""


class Unwaiting:
    """Virtual time that the recorder does not know from real time.

    A reading asks the system as one of real time does, and is the time here.
    """

    speed: float = 0

    def __init__(self) -> None:
        self._clock = clock = VirtualClock()
        self.start, self.wait = clock.start, clock.wait

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        monotonic_ns()
        return self._clock._now  # noqa: SLF001 -- a real one reads its epoch so


@dataclass(frozen=True, slots=True)
class Run:
    """Processor time of a step, lateness, what was recorded in a second; ns by step."""

    step_us: float
    p50_us: float
    p99_us: float
    bytes_per_second: float
    within: list[int]
    """From the end of the loop's last hook until it has been counted: the wait, and the step."""
    between: list[int]
    """From there to the end of the last hook."""


class _Stopwatch:
    """The loop's last hook, and what notes that a step has been counted; spans in ns."""

    def __init__(self) -> None:
        self.within: list[int] = []
        self.between: list[int] = []
        self._begun_at = self._counted_at = 0

    def between_steps(self, _now: int, _left: int) -> None:
        """All hooks have been called."""
        self._begun_at = perf_counter_ns()
        if self._counted_at > 0:
            self.between.append(self._begun_at - self._counted_at)
            self._counted_at = 0

    def stopped(self, commit: Callable[..., int]) -> Callable[..., int]:
        """The ledger's `commit`, noted."""

        def noted(*arguments: Any) -> int:  # noqa: ANN401 -- as they are
            next_at = commit(*arguments)
            self._counted_at = perf_counter_ns()
            self.within.append(self._counted_at - self._begun_at)
            return next_at

        return noted


class _OwnRecorder(Recorder):
    """Records what a robot with chips would: nothing of the models of a doubles' world."""

    def instrument(self, _atomic: Atomic, functions: Functions) -> Functions:
        """A model as it is."""
        return functions

    def write_into(self, ring: Any, atomics: Sequence[Atomic], *rest: Any, **named: Any) -> None:  # noqa: ANN401 -- as they are
        """Tap the robot's own ports alone; this recording is never read."""
        super().write_into(ring, [each for each in atomics if each in self.own], *rest, **named)


def measured(board: str, folder: Path, name: str, span_s: float, clock: Clock) -> Run:
    """Run a board for a second, then for `span_s`, which is measured."""
    recorder = _OwnRecorder if name == OWN else Recorder
    is_bare = name in (BARE, AGAIN)
    with patch.object(recorded_edge, "Recorder", recorder):
        session = start_session(
            board_in_force(board, ()),
            clock,
            doubles=True,
            statistics_path=folder / "bench.statistics",
            recording=None if is_bare else folder / "bench.recording",
        )
    stopwatch = _Stopwatch()
    try:
        session.run_on(seconds(1))
        session.executive.hooks.append(stopwatch)
        before, begun = session.executive.cells[STEPS], process_time_ns()
        with patch.object(Ledger, "commit", stopwatch.stopped(Ledger.commit)):
            session.run_on(seconds(1 + span_s))
        spent = process_time_ns() - begun
        steps = session.executive.cells[STEPS] - before
        session.end()
    finally:
        session.close()
    models = session.executive.statistics.figures().models.values()
    busiest = max(models, key=lambda model: model.run)
    written = 0 if is_bare else _written(folder / "bench.recording")
    return Run(
        spent / steps / MICROSECOND,
        busiest.lateness_us.p50 or 0.0,
        busiest.lateness_us.p99 or 0.0,
        written / (1 + span_s),
        stopwatch.within,
        stopwatch.between,
    )


def _written(path: Path) -> int:
    """Bytes of the sections of a recording."""
    contents = read_recording(path).contents()
    return sum(len(content) for content in contents if kind_of(content) != Kind.HEADER)


def least_us(spans: Sequence[Sequence[int]]) -> float:
    """The mean of all steps, of each the least of equal runs, us."""
    least = [min(each) for each in zip(*spans, strict=True)]
    return fmean(least) / MICROSECOND
