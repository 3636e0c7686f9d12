"""Prediction of how long after its deadline a board's step is over, from recorded own times.

The board is run on its doubles in virtual time: that gives its timetable, which is for each step
its instant, the models that have a part in it, and the time its transactions take on the wire. Then
the timetable is gone through with own times as they were recorded, drawn for each model by itself,
and a waking as late as one recorded: a step begins when it is due and the one before is over.

What was recorded has an end: one in a thousand of few samples is among the largest, or beyond them.
So the percentile is taken at half that share, and has a margin. Models may be slow together, by
caches or a lower clock: what recorded steps took longer than their models, drawn by themselves,
is added. `bench prediction` shows how often the bound holds.

Own times of a run on chips hold the time on the wire as it was: only what the wires take beyond
that is added. On doubles nothing waits for a wire, and own times hold what the doubles compute.
"""

from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import accumulate
from random import Random
from typing import Final

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import Step
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.histogram import Histogram, upper_edge
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.statistics import Statistics

LEAST_STEPS: Final = 1000
"""Recorded: fewer say nothing of one in a thousand."""
TIMETABLE: Final = 10_000
"""Steps of a timetable: fewer would make much of a start, and little of what seldom coincides."""
STRETCH, LONGEST = 10 * SECOND, 300 * SECOND
DRAWN: Final = 30_000
"""Steps gone through at least: 15 of them are beyond the percentile."""
BEYOND: Final = 0.0005
MARGIN: Final = 1.15


class TimedStep(Struct, frozen=True):
    """A step of a timetable: its instant, the models that have a part in it, its time on wires."""

    at: int
    models: tuple[str, ...]
    wire_ns: int


class Prediction(Struct, frozen=True):
    """Bounds that 999 of 1000 steps keep, ns."""

    response_ns: int
    """From the instant that a step is for to its end: lateness, own times, time on the wire."""
    lateness_ns: int
    """As recorded."""
    wire_ns: int
    """The longest that a step has the wires for."""
    period_ns: int | None
    """The shortest of a model; None where none has one."""
    unrecorded: Sequence[str]
    """Models whose own time is not recorded: each was taken for as slow as a whole step."""

    def sentence(self) -> str:
        """Return the prediction in words."""
        parts = f"lateness {_ms(self.lateness_ns)}, on the wire {_ms(self.wire_ns)} at most"
        bound = f"999 of 1000 steps are over {_ms(self.response_ns)} after they are due ({parts})"
        names = ", ".join(self.unrecorded)
        return f"{bound}; own time not recorded: {names}" if names else bound

    def warning(self) -> str | None:
        """Return the sentence that warns of steps that are not over when the next are due."""
        if self.period_ns is None or self.response_ns <= self.period_ns:
            return None
        return (
            f"steps are predicted to be over {_ms(self.response_ns)} after they are due, but the "
            f"shortest period is {_ms(self.period_ns)}"
        )


def _ms(ns: int) -> str:
    return f"{ns / MILLISECOND:.3g} ms" if ns >= MILLISECOND else f"{ns / MICROSECOND:.0f} us"


def predicted(board: Board, recorded: Statistics) -> Prediction:
    """Predict how late a board's steps are over, on the machine that the statistics are from.

    Raises ConfigError for a board without doubles, and for statistics that say too little.
    """
    _demand_enough(recorded)
    robot = [each for each in with_all_below(board.unconnected().model) if isinstance(each, Atomic)]
    steps = timetable(board, {below_root(each.path) for each in robot})
    whole_step, lateness = _Samples(recorded.step_times()), _Samples(recorded.lateness())
    named = {path: recorded.own_time_of(n) for n, path in enumerate(recorded.layout.models)}
    times = {path: _Samples(own_time) for path, own_time in named.items() if own_time.samples}
    needed = {name for step in steps for name in step.models}
    if not needed & times.keys():
        other = (
            f"of a run of {recorded.header.board or 'another model'}: none of its models is here"
        )
        raise ConfigError.of_one("statistics", f"{other}; expected a run of {board.name}")
    unrecorded = sorted(needed - times.keys())
    times |= dict.fromkeys(unrecorded, whole_step)
    added = _added_share(board, recorded, steps)
    passed = list(_responses(steps, times, lateness, added))
    responses, alone = (_exceeded_by_few(sorted(each)) for each in zip(*passed, strict=True))
    together = max(whole_step.exceeded_by_few() - alone, 0)
    return Prediction(
        response_ns=round(MARGIN * (responses + together)),
        lateness_ns=recorded.lateness().percentile(999) or 0,
        wire_ns=max(step.wire_ns for step in steps),
        period_ns=min((each.period for each in robot if each.period != NEVER), default=None),
        unrecorded=unrecorded,
    )


def _demand_enough(recorded: Statistics) -> None:
    """Raise ConfigError for statistics of virtual time, or of few steps."""
    counted = recorded.step_times().samples
    if recorded.is_virtual:
        raise ConfigError.of_one("statistics", "of a run in virtual time, in which nothing lasts")
    if counted < LEAST_STEPS:
        few = f"of {counted} steps; expected {LEAST_STEPS} or more to say what one in 1000 exceeds"
        raise ConfigError.of_one("statistics", few)


def _added_share(board: Board, recorded: Statistics, steps: Sequence[TimedStep]) -> float:
    """Return the share of the time on the wire that is not in the recorded own times."""
    nodes = tuple(f"{bus.device} 0x" for bus in board.settings.buses.values())
    written = recorded.header.conditions.get("switched_off", ())
    if not (nodes and any(str(each).startswith(nodes) for each in written)):
        return 1.0
    figures = recorded.figures()
    in_them = sum(each.utilisation or 0.0 for each in figures.bus.values())
    spanned = steps[-1].at - steps[0].at
    wanted = sum(step.wire_ns for step in steps) / max(spanned, 1)
    return max(1 - in_them / wanted, 0.0) if wanted > 0 else 0.0


def timetable(board: Board, own: Collection[str]) -> list[TimedStep]:
    """Return the steps of a board on its doubles in which one of these models has a part.

    Raises ConfigError for a board without doubles.
    """
    with closing(start_session(board, VirtualClock(), doubles=True, statistics_path=None)) as run:
        observer = _Observer(run, own)
        run.executive.hooks.append(observer)
        for until in range(STRETCH, LONGEST + 1, STRETCH):
            run.run_on(until)
            if len(observer.steps) >= TIMETABLE or run.executive.is_over:
                break
        run.end()
        return observer.steps


class _Observer:
    """A hook that writes down the step that is over, if there was one since it was called last."""

    def __init__(self, session: Session, own: Collection[str]) -> None:
        step = session.executive.state["step"]
        assert isinstance(step, Step)  # noqa: S101 -- by its name
        lines = session.hardware.lines.buses.values()
        self.steps: list[TimedStep] = []
        self._executive, self._step, self._own = session.executive, step, own
        self._buses = [bus for bus in lines if isinstance(bus, AccountedBus)]
        self._counted, self._busy_ns = 0, self._busy()

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        """Note its models and its time on the wires."""
        counted, busy_ns, step = self._executive.cells[STEPS], self._busy(), self._step
        if counted == self._counted:
            return
        ran = {step.paths[number] for number in step.laps.noted[0::4]}
        if models := tuple(sorted(ran.intersection(self._own))):
            self.steps.append(TimedStep(step.at, models, busy_ns - self._busy_ns))
        self._counted, self._busy_ns = counted, busy_ns

    def _busy(self) -> int:
        return sum(bus.busy_ns for bus in self._buses)


class _Samples:
    """Draws from a histogram, each value rounded up as its percentiles are."""

    def __init__(self, histogram: Histogram) -> None:
        self._counted = tuple(accumulate(histogram.buckets))
        self._largest = histogram.largest

    def draw(self, random: Random) -> int:
        """Return a sample, ns; 0 if there is none."""
        return self._at(random.random())

    def exceeded_by_few(self) -> int:
        """Return the sample that as few exceed as a prediction, ns."""
        return self._at(1 - BEYOND)

    def _at(self, share: float) -> int:
        rank = share * self._counted[-1]
        return min(upper_edge(bisect_left(self._counted, rank)), self._largest)


def _exceeded_by_few(ordered: Sequence[int]) -> int:
    return ordered[-1 - int(BEYOND * len(ordered))]


def _responses(
    steps: Sequence[TimedStep],
    times: Mapping[str, _Samples],
    lateness: _Samples,
    wire_share: float,
) -> Iterator[tuple[int, int]]:
    """Go through a timetable, over and over; give the ns from each instant to its step's end.

    Beside it stands the sum of its models' own times.

    One thread: a step waits for the end of the one before.
    """
    random = Random(1)  # noqa: S311 -- no secret; the same prediction each time
    for _ in range(-(-DRAWN // len(steps))):
        free_at = 0
        for step in steps:
            started = max(step.at + lateness.draw(random), free_at)
            own = sum(times[name].draw(random) for name in step.models)
            free_at = started + own + round(wire_share * step.wire_ns)
            yield free_at - step.at, own
