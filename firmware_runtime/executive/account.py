"""The account of one periodic model: what became of each of its activations.

An activation is an instant the model has booked ahead of time, by a positive time advance: its
deadline. (A zero time advance continues the activation it follows.) Exactly one thing becomes of it

- run: the internal or confluent transition of that instant was completed, on time or late;
- skipped: it was due, and dropped, by the policy or by the end of the run;
- coalesced: it was due by the clock, but an event that had arrived before it made the model plan
  anew, and that instant was no longer booked when its turn came;

or nothing yet, or the model planned anew before it was due: then it is not counted at all. What has
been `scheduled` is the sum, and all counters are written at once. Hence the identity

    scheduled = run + skipped + coalesced

An overrun is an activation that ran later than the tolerance. An episode is a row of overruns and
skips that no activation on time interrupts: one stall is one episode, whatever the policy.
"""

from collections.abc import Callable
from dataclasses import replace
from struct import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.telemetry.histogram import Cells, Histogram, empty_cells
from firmware_runtime.telemetry.layout import MODEL, Layout

_COUNTERS = Struct(f"{len(MODEL)}q")
"""The block of one model in the file: packed at once, which costs little more than one counter."""


class ModelAccount:
    """Watches one model during a step (as an instrument), and counts after it.

    `number` is the model's place among the step's own times, `index` among the file's periodic
    models; `deadline` is the instant it is booked at, NEVER if it waits for input. During a step
    `ran` and `replanned` note what happened; `count` moves them into the cells. Of the episode
    under way, or the last one, there is the latest activation, ns, how many were missed, and the
    `cause` of the first overrun, as the ledger found it.
    """

    def __init__(self, atomic: Atomic, path: str, number: int, policy: ActivationPolicy) -> None:
        self.atomic = atomic
        self.path = path
        self.number = number
        self.policy = policy
        self.skips = policy.policy == "skip"
        self.period = atomic.period
        self.tolerance = policy.tolerance(atomic.period)
        self.stop_after = policy.stop_after()
        self.deadline = NEVER
        self.lateness = 0
        self.ran = False
        self.replanned = 0
        self.run = 0
        self.skipped = 0
        self.coalesced = 0
        self.overruns = 0
        self.episodes = 0
        self._last_late = 0
        self.in_episode = False
        self.latest_in_episode = 0
        self.missed_in_episode = 0
        self.cause = ""
        self.index = 0
        self._block = empty_cells(len(MODEL)).cast("B")
        self.late_by = self._own_time = Histogram(empty_cells())

    def count_in(self, cells: Cells, layout: Layout, index: int) -> None:
        """From now on, count in this model's block of the statistics file."""
        self.index = index
        first = layout.model(index)
        self._block = cells[first : first + len(MODEL)].cast("B")
        self.late_by = Histogram(cells[layout.lateness(index)])
        self._own_time = Histogram(cells[layout.step(index)])

    # During a step ------------------------------------------------------------------------------

    def watch(
        self,
        functions: Functions,
        step: Step,
        touched: list["ModelAccount"],
    ) -> Functions:
        """Wrap the model's functions; an account with something to count joins `touched`."""
        atomic, number, began_at = self.atomic, self.number, step.began_at

        def book() -> None:
            """Note the instant the model books with its present time advance."""
            sigma = atomic.sigma
            # a time advance that is no such thing is refused by the simulator, next
            books = sigma.__class__ is int and 0 < sigma < NEVER
            self.deadline = step.at + sigma if books else NEVER

        def due(transition: Callable[[], None]) -> Callable[[], None]:
            def call() -> None:
                transition()
                if self.deadline == step.at:
                    self.ran = True
                    self.lateness = began_at[number] - step.at
                    touched.append(self)
                book()

            return call

        def external(elapsed: int) -> None:
            begun, booked = step.lap, self.deadline
            functions.external(elapsed)
            book()
            if booked <= begun and booked != self.deadline:
                self.replanned += 1
                touched.append(self)

        def confluent() -> None:
            functions.internal()
            functions.external(0)

        return replace(
            functions,
            internal=due(functions.internal),
            external=external,
            confluent=due(functions.confluent or confluent),
        )

    # After it -----------------------------------------------------------------------------------

    def count(self, at: int, own_time: int) -> None:
        """Count what the step at instant `at` has left in `ran` and `replanned`."""
        self.coalesced += self.replanned
        self.replanned = 0
        if self.ran:
            self.ran = False
            self.run += 1
            self.late_by.record(self.lateness)
            self._own_time.record(own_time)
            if self.lateness <= self.tolerance:
                self.in_episode = False
            else:
                self.overruns += 1
                self._last_late = at
                self._miss()
                self.latest_in_episode = max(self.latest_in_episode, self.lateness)
        self._write()

    def skip(self, activations: int) -> None:
        """Count activations that were due and are dropped."""
        self.skipped += activations
        self._miss()
        self.missed_in_episode += activations
        self._write()

    def skip_to(self, now: int) -> None:
        """Drop every deadline before `now`; the next one keeps the phase."""
        missed = -(-(now - self.deadline) // self.period)
        self.skip(missed)
        self.deadline += missed * self.period

    def skip_due(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""
        if self.deadline <= now:
            self.skip((now - self.deadline) // self.period + 1)

    def _miss(self) -> None:
        """Start an episode, unless one is under way."""
        if not self.in_episode:
            self.in_episode = True
            self.episodes += 1
            self.latest_in_episode = self.missed_in_episode = 0
            self.cause = ""

    def _write(self) -> None:
        """Move the counters into the file."""
        _COUNTERS.pack_into(
            self._block,
            0,
            self.run + self.skipped + self.coalesced,
            self.run,
            self.skipped,
            self.coalesced,
            self.overruns,
            self.episodes,
            self._last_late,
        )
