"""A step, and the account of one model: what became of each activation, in counters, histograms.

When a step is over, each model that took part in it gets its transitions, in order, with what the
clock said and what the model had booked by then (`accounting`), and settles its account. During the
step nothing stands between the simulator and the model.

What an activation is, and when it is due, is the business of the two kinds of account:
`EventAccount` is of a model without a period, `periodic_account` of one with a period. Exactly one
thing becomes of an activation that is due

- run: the internal or confluent transition of that instant was completed, on time or late;
- skipped: it was due, and dropped, by the policy, by the end of the run or by the model itself;
- coalesced: it was due by the clock, but an event that had arrived before it made the model book
  another, and that instant was no longer booked when its turn came;

or nothing yet: then it is not counted. What has been `scheduled` is the sum, and all counters are
written at once. Hence the identity

    scheduled = run + skipped + coalesced

The deadline of the next activation stands in the file beside them, and whether the model is still
within the period before it. By these a reader sees what is due by the clock and has not run,
whether or not the loop ever gets there (`statistics.file_header`).

An overrun is an activation that ran later than the tolerance. An episode is a row of overruns and
skips that no activation on time interrupts: one stall is one episode, whatever the policy.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from functools import partial
from struct import Struct
from typing import Any, Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.devs.functions import EXTERNAL, INTERNAL_OF_BOTH, Laps
from firmware_runtime.devs.time import NEVER, kept
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics.histogram import Cells, Histogram, empty_cells
from firmware_runtime.statistics.layout import MODEL, Layout

_BY_ACTIVATION = MODEL.index("is_in_period") + 1
_COUNTERS = Struct(f"{_BY_ACTIVATION}q")
"""What changes with each activation: packed at once, which costs little more than one counter."""
_IRREGULAR, _RETURNED, REACTIONS = map(MODEL.index, ("irregular", "returned_ns", "reactions"))


class Step:
    """The instant under way, and what divides its time among the models.

    `at` is the instant of the run it stands for, `started` what the clock read when it began,
    `ended` when it was over. In `laps` the simulator notes what the clock reads when a model's
    function returns: the time from one lap to the next is the own time of that model. So the clock
    is read once a function, and own times, one for each model in order of declaration, add up to
    the time of the step. `began_at` is when each model's output function began, the last time it
    did. Both are known when the step is settled (`accounting`).

    A reading is what is read less `epoch`. Where the clock `stands_still` during a step, nothing is
    read in it.
    """

    def __init__(self, now: Callable[[], int], *, stands_still: bool = False) -> None:
        self.at = 0
        self.started = 0
        self.ended = 0
        self.epoch = 0
        self.laps = Laps(int if stands_still else now)  # `int()` is zero
        self.stands_still = stands_still
        self.paths: list[str] = []
        self.own_times: list[int] = []
        self.began_at: list[int] = []
        self._now = now
        self._zeros: list[int] = []

    def join(self, component: Component) -> int:
        """Give a model its place, in order of declaration; return its number."""
        self.paths.append(below_root(component.path))
        for column in (self.own_times, self.began_at, self._zeros):
            column.append(0)
        return len(self.paths) - 1

    def read_from(self, read: Callable[[], int], epoch: int) -> None:
        """Read the time from there, from now on; it reads `epoch` at instant 0 of the run."""
        self.laps.read, self.epoch = read, epoch

    def begin(self, at: int) -> None:
        """Enter an instant, with all own times at zero."""
        self.at = at
        self.own_times[:] = self._zeros
        self.laps.noted.clear()
        if self.stands_still:
            self.started = self._now()
            self.epoch = -self.started
        else:
            self.started = self.laps.read() - self.epoch

    def readings(self) -> list[int]:
        """What the clock said in the step that is over, in order; instants of the run, ns."""
        epoch = self.epoch
        return [self.started, *[each - epoch for each in self.laps.noted[2::4]], self.ended]


class Answering(Protocol):
    """What ends with a transition that has read input; `accounting.DeadlineWatch` does."""

    def answer(self, step: Step, place: int, now: int) -> None:
        """Take it that such a one is over, when so much had been noted and it was `now`."""


class ModelAccount(ABC):
    """Counts one model's activations after each step.

    `number` is the model's place among the step's own times and among the file's models; `due`
    is the deadline of the next activation, NEVER if none is planned, and `booked` the instant of
    the model's next event. It `is_in_period` while phases of the activation before are
    still to come. Of the episode under way, or the last one, there is the latest activation, ns,
    how many were missed, and the `cause` of the first overrun, as the ledger found it.

    In a step `follow` is called for each transition, then `count` once. `answers` are the deadlines
    that end with it.
    """

    __slots__ = (  # more attributes than an instance without slots finds quickly
        *("_last_late", "_pack", "_step", "answers", "atomic", "booked", "cause", "cells"),
        *("coalesced", "due", "episodes", "has_run", "in_episode", "irregular", "is_plain"),
        *("is_in_period", "late_by", "lateness", "latest_in_episode", "missed_in_episode"),
        *("number", "overruns", "own_time", "path", "policy", "put_off", "reactions", "run"),
        *("skipped", "stop_after", "tolerance", "written_due"),
    )
    kind: str
    period: int = NEVER
    kept: tuple[str, ...] = (
        *("due", "booked", "lateness", "run", "skipped", "coalesced", "overruns"),
        *("episodes", "irregular", "reactions", "_last_late", "in_episode"),
        *("is_in_period", "latest_in_episode", "missed_in_episode"),
    )
    """What `state` has of it; a cause is the system's, and a replay has none."""

    def __init__(
        self, atomic: Atomic, step: Step, policy: ActivationPolicy, tolerance: int
    ) -> None:
        self.atomic = atomic
        self.number = number = step.join(atomic)
        self.path = step.paths[number]
        self.answers: tuple[Answering, ...] = ()
        self.is_plain = self.period == NEVER
        """Whether no transition counts by itself, unless it was due: without period and answers."""
        self._step = step
        self.policy = policy
        self.tolerance = tolerance
        self.stop_after = policy.stop_after()
        self.due = self.booked = NEVER
        self.lateness = 0
        self.has_run = False
        """Whether an activation has run in the step that is settled."""
        self.run = 0
        self.skipped = 0
        self.coalesced = 0
        self.written_due = 0
        """The deadline in the file; 0 where it may hold something else that has changed."""
        self.put_off = NEVER
        """A deadline that has passed, while an input from before it is answered in zero time."""
        self.overruns = 0
        self.episodes = 0
        self.irregular = 0
        self.reactions = 0
        self._last_late = 0
        self.in_episode = self.is_in_period = False
        self.latest_in_episode = 0
        self.missed_in_episode = 0
        self.cause = ""
        self.cells = empty_cells(len(MODEL))
        self._pack = partial(_COUNTERS.pack_into, self.cells.cast("B"), 0)
        self.late_by = self.own_time = Histogram(empty_cells())

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """From now on, count in this model's block of the statistics file."""
        index = self.number
        first = layout.model(index)
        self.cells = cells[first : first + len(MODEL)]
        self._pack = partial(_COUNTERS.pack_into, self.cells.cast("B"), 0)
        self.late_by = Histogram(cells[layout.lateness(index)])
        self.own_time = Histogram(cells[layout.step(index)])
        self.write()

    def begin(self, due: int) -> None:
        """Take over the model's first booking, NEVER if it has none."""
        self.due = due

    def state(self) -> dict[str, Any]:
        """What it has counted, and what it waits for; its histograms have a state of their own."""
        counted = {name: getattr(self, name) for name in self.kept}
        return counted | {"cells": self.cells.tobytes()}

    def restore(self, state: dict[str, Any]) -> None:
        """Have counted that. Raises ValueError or KeyError for what is no such state."""
        for name in self.kept:
            setattr(self, name, kept(state[name]))
        self.cells.cast("B")[:] = state["cells"]

    @abstractmethod
    def follow(  # noqa: PLR0913, PLR0917 -- what is known of it
        self, function: int, at: int, begun: int, ended: int, began_at: int, sigma: int
    ) -> None:
        """See what a transition was, and what it has booked.

        `function` (`devs.functions`) was called at `begun` and had returned at `ended`; the output
        function before it began at `began_at`; the model's time advance is `sigma` from then on.
        """

    @abstractmethod
    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""

    def skip(self, activations: int) -> None:
        """Count activations that were due and are dropped."""
        self.miss(activations)
        self.write()

    def miss(self, activations: int) -> None:
        """Count dropped activations; the file gets them with the next `write`."""
        self.skipped += activations
        self._open_episode()
        self.missed_in_episode += activations

    def count_run(self, at: int, samples: list[object]) -> None:
        """Count an activation that ran in the step at instant `at`."""
        self.run += 1
        lateness = self.lateness
        samples += self.late_by, lateness
        if lateness <= self.tolerance:
            self.in_episode = False
        else:
            self.overruns += 1
            self._last_late = at
            self._open_episode()
            if lateness > self.latest_in_episode:
                self.latest_in_episode = lateness

    def write(self) -> None:
        """Move the counters into the file."""
        self._pack(
            self.run + self.skipped + self.coalesced,
            self.run,
            self.skipped,
            self.coalesced,
            self.overruns,
            self.episodes,
            self._last_late,
            self.due,
            self.is_in_period,
        )

    def _count_irregular(self, returned: int) -> None:
        """Count a return at another time than the period says, ns after the activation before."""
        self.irregular = self.cells[_IRREGULAR] = self.irregular + 1
        self.cells[_RETURNED] = returned

    def _open_episode(self) -> None:
        """Start an episode, unless one is under way."""
        if not self.in_episode:
            self.in_episode = True
            self.episodes += 1
            self.latest_in_episode = self.missed_in_episode = 0
            self.cause = ""


class EventAccount(ModelAccount):
    """Counts the booked events of a model without a period, and its reactions.

    Its activations are its events: instants booked ahead of time, by a positive time advance. That
    instant is the deadline. A booking that an input moves before it is due never was one, and one
    that still stands after an input was answered in zero time has not been moved. What a model does
    without having booked it, answering an input at the input's own instant, is a reaction: it has
    no deadline of its own, so no lateness either, but its own time counts.
    """

    __slots__ = ()
    kind = "event"
    kept = (*ModelAccount.kept, "written_due", "put_off")

    def follow(  # noqa: PLR0913, PLR0917 -- as it says
        self,
        function: int,
        at: int,
        begun: int,
        ended: int,  # noqa: ARG002 -- as of the other kind
        began_at: int,
        sigma: int,
    ) -> None:
        """See what a transition was, and what it has booked."""
        if function == INTERNAL_OF_BOTH:  # what it books then, its external one replaces
            return
        booked = self.due
        self.due = at + sigma if 0 < sigma < NEVER else NEVER
        if function == EXTERNAL:
            if booked <= begun and booked != self.due:
                self.replan(booked, sigma)
            return
        if booked == at:
            self.has_run = True
            self.lateness = began_at - at
        if self.put_off != NEVER:
            self.replan(self.put_off, sigma)

    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""
        if min(self.due, self.put_off) <= now:
            self.skip(1)
        self.due = NEVER
        self.write()

    def replan(self, passed: int, sigma: int) -> None:
        """An input from before a deadline that has passed has the model book, or go on at once."""
        if sigma == 0:
            self.put_off = passed
        else:
            if passed != self.due:
                self.coalesced += 1
            self.put_off, self.written_due = NEVER, 0


def count_events(accounts: Iterable[ModelAccount], step: Step, samples: list[object]) -> None:
    """Count what a step has left of models without a period, all in one frame.

    `samples` gets histograms and values to be recorded in them, in turns.
    """
    own_times = step.own_times
    for account in accounts:
        if account.period != NEVER:
            continue
        samples += account.own_time, own_times[account.number]
        if account.has_run:
            account.count_run(step.at, samples)
        else:
            account.reactions = account.cells[REACTIONS] = account.reactions + 1
            if account.due == account.written_due:
                continue
        account.write()
        account.written_due = account.due
