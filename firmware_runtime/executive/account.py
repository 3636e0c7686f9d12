"""The account of one model: what became of each of its activations, in counters and histograms.

During the run the account stands in the model's place: the simulator calls it, it calls the model,
times the call, and notes what the model has booked. That is one frame around a
model's function, written out for each, and the only one.

What an activation is, and when it is due, is the business of the two kinds of account
(`periodic_account`, `event_account`). Exactly one thing becomes of an activation that is due

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
from collections.abc import Callable
from functools import partial
from struct import Struct
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER, kept, whole
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.histogram import Cells, Histogram, empty_cells
from firmware_runtime.statistics.layout import MODEL, Layout

_BY_ACTIVATION = MODEL.index("is_in_period") + 1
_COUNTERS = Struct(f"{_BY_ACTIVATION}q")
"""What changes with each activation: packed at once, which costs little more than one counter."""
NOTHING, TOOK_PART, RAN = range(3)
"""What a step has left to count, of one model: that it took part, or that an activation ran."""
_IRREGULAR, RETURNED, REACTIONS = map(MODEL.index, ("irregular", "returned_ns", "reactions"))


class ModelAccount(ABC):
    """Stands in one model's place during a step, and counts after it.

    `number` is the model's place among the step's own times and among the file's models; `due`
    is the deadline of the next activation, NEVER if none is planned, and `booked` the instant of
    the model's next event. It `is_in_period` while phases of the activation before are
    still to come. During a step `noted` and the like say what happened; `settle` moves it
    into the cells. Of the episode under way, or the last one, there is the latest activation, ns,
    how many were missed, and the `cause` of the first overrun, as the ledger found it.
    `answers` are called when the model has read input: deadlines that end with it. `sigma` is the
    model's time advance after its last transition.
    """

    __slots__ = (  # more attributes than an instance without slots finds quickly
        "_call_external",
        "_call_internal",
        "_call_output",
        "_last_late",
        "_now",
        "_pack",
        "_step",
        "answers",
        "atomic",
        "booked",
        "cause",
        "cells",
        "coalesced",
        "confluent",
        "due",
        "episodes",
        "in_episode",
        "irregular",
        "is_in_period",
        "late_by",
        "lateness",
        "latest_in_episode",
        "missed_in_episode",
        "noted",
        "number",
        "overruns",
        "own_time",
        "path",
        "policy",
        "reactions",
        "run",
        "sigma",
        "skipped",
        "stop_after",
        "tolerance",
    )
    kind: str
    period: int = NEVER
    kept: tuple[str, ...] = (
        *("due", "booked", "lateness", "noted", "run", "skipped", "coalesced", "overruns"),
        *("episodes", "irregular", "reactions", "sigma", "_last_late", "in_episode"),
        *("is_in_period", "latest_in_episode", "missed_in_episode"),
    )
    """What `state` has of it; a cause is the system's, and a replay has none."""

    def __init__(
        self,
        atomic: Atomic,
        functions: Functions,
        step: Step,
        policy: ActivationPolicy,
        tolerance: int,
    ) -> None:
        self.atomic = atomic
        self.number = number = step.join(atomic)
        self.path = step.paths[number]
        self.sigma = NEVER
        self.answers: tuple[Callable[[], None], ...] = ()
        self.confluent: Callable[[], None] | None = functions.confluent
        self._call_output = functions.output
        self._call_internal = functions.internal
        self._call_external = functions.external
        self._step = step
        self._now = step.now
        self.policy = policy
        self.tolerance = tolerance
        self.stop_after = policy.stop_after()
        self._clear()

    def _clear(self) -> None:
        """Nothing is booked and nothing has happened."""
        self.due = self.booked = NEVER
        self.lateness = 0
        self.noted = NOTHING
        self.run = 0
        self.skipped = 0
        self.coalesced = 0
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

    # In the model's place, during a step ---------------------------------------------------------

    def output(self) -> None:
        """Have the model send."""
        step, number = self._step, self.number
        begun = step.began_at[number] = step.lap
        send, now = self._call_output, self._now  # as locals, which CPython calls sooner
        send()
        ended = step.lap = now()
        step.own_times[number] += ended - begun

    @abstractmethod
    def internal(self) -> None:
        """Have the model make its internal transition."""

    @abstractmethod
    def external(self, elapsed: int) -> None:
        """Have the model read its input, `elapsed` ns after its last transition."""

    def _plain_time_advance(self) -> int:
        """The model's time advance as an `int`, from now on, if it is whole and of another type.

        One that is no whole number is refused by the simulator, next; until then it counts as zero.
        """
        sigma = whole(self.atomic.sigma)
        if sigma is None:
            return 0
        self.atomic.sigma = self.sigma = sigma
        return sigma

    # After it -----------------------------------------------------------------------------------

    @abstractmethod
    def settle(self, at: int, own_time: int) -> bool:
        """Count what the step at instant `at` has left; return whether an activation ran."""

    @abstractmethod
    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""

    def is_to_skip(self) -> bool:
        """Whether it is through with a period, and whole ones are to be dropped."""
        return False

    def skip_to(self, now: int) -> int:
        """Drop every activation booked before `now`; return when the next is due, in phase."""
        raise NotImplementedError(f"{self.path}: nothing of it recurs before {now}")

    def skip(self, activations: int) -> None:
        """Count activations that were due and are dropped."""
        self.miss(activations)
        self.write()

    def miss(self, activations: int) -> None:
        """Count dropped activations; the file gets them with the next `write`."""
        self.skipped += activations
        self._open_episode()
        self.missed_in_episode += activations

    def count_run(self, at: int) -> None:
        """Count an activation that ran in the step at instant `at`."""
        self.run += 1
        lateness = self.lateness
        self.late_by.record(lateness)
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

    def count_irregular(self, returned: int) -> None:
        """Count a return at another time than the period says, ns after the activation before."""
        self.irregular = self.cells[_IRREGULAR] = self.irregular + 1
        self.cells[RETURNED] = returned

    def _open_episode(self) -> None:
        """Start an episode, unless one is under way."""
        if not self.in_episode:
            self.in_episode = True
            self.episodes += 1
            self.latest_in_episode = self.missed_in_episode = 0
            self.cause = ""
