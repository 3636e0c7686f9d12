"""The account of a periodic model: one activation is one period, however many phases it has.

Deadlines are the first booking and every whole period after it. The event at a deadline is the
activation; those between two deadlines are its further phases (waiting for a conversion, reading,
sleeping for the rest), and their own time is the activation's. A transition with a time advance of
zero continues what it follows.

A model keeps its period if it comes back at its deadlines. One that comes back later, at another
instant, has contradicted what it states: that is counted (`irregular`), its cycle is taken to go on
from there, and what it has moved by is added up. Each whole period of that sum, and each one slept
through, is an activation that was due and did not run. So what is scheduled stays what the clock
says, to less than a period, whatever the model does.

An input may move the deadlines: to the first instant after the deadline that the model books
because of it, at once or by way of phases before the deadline. If one of those books a whole period
it was the activation. A model that is passive has no deadline until an input makes it book one.
"""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import CONFLUENT, EXTERNAL, EXTERNAL_OF_BOTH
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import ModelAccount, Step
from firmware_runtime.executive.policy import ActivationPolicy

_TAKES_INPUT = frozenset({EXTERNAL, EXTERNAL_OF_BOTH})


class PeriodicAccount(ModelAccount):
    """Counts the periods of one model; `spent` is its own time since the last activation began."""

    __slots__ = (
        "_came_back_after",
        "_is_answering",
        "_is_by_input",
        "_moved_at",
        "_slip",
        "period",
        "skips",
        "spent",
    )
    kind = "periodic"
    kept = (
        *(*ModelAccount.kept, "spent", "_slip", "_came_back_after"),
        *("_is_answering", "_is_by_input", "_moved_at"),
    )

    def __init__(self, atomic: Atomic, step: Step, policy: ActivationPolicy) -> None:
        self.period = atomic.period
        super().__init__(atomic, step, policy, policy.tolerance(atomic.period))
        self.skips = policy.policy == "skip"
        self.spent = 0
        self._slip = 0
        self._came_back_after = 0
        """Ns after the activation before it, of one in the step under way that was irregular."""
        self._is_answering = False
        """An input is being answered in zero time: what the model books then is its plan."""
        self._moved_at = NEVER
        """When an input moved the next event to before the deadline; NEVER: none did."""
        self._is_by_input = False
        """Either of both."""

    def begin(self, due: int) -> None:
        """Take over the model's first booking, NEVER if it has none."""
        self.due = self.booked = due

    def count(self, step: Step, samples: list[object]) -> None:
        """Count what the step has left."""
        at, own_time = step.at, step.own_times[self.number]
        if not self.has_run:
            self.spent += own_time
        else:
            if self.run > 0:
                samples += self.own_time, self.spent
            self.spent = own_time
            if self.lateness <= self.tolerance:  # as `count_run` would: this is a good run's
                self.run += 1
                samples += self.late_by, self.lateness
                self.in_episode = False
            else:
                self.count_run(at, samples)
            if self._came_back_after > 0:
                self._count_irregular(self._came_back_after)
                self._came_back_after = 0
        self.is_in_period = self.booked < self.due and self._moved_at == NEVER
        self.write()

    def follow(  # noqa: PLR0913, PLR0917 -- as it says
        self, function: int, at: int, begun: int, ended: int, began_at: int, sigma: int
    ) -> None:
        """See what a transition was, and what it has booked."""
        if function in _TAKES_INPUT:
            self._take_input(at, begun, sigma)
            return
        is_due = at >= self.due
        if is_due:
            self._activate(at, began_at)
        if function == CONFLUENT:
            if is_due:
                self.booked = self.due
            self._take_input(at, at, sigma)
        elif self._is_by_input:
            self._book_after_input(at, ended, began_at, sigma)
        elif 0 < sigma < NEVER:
            self.booked = at + sigma
        elif sigma == NEVER:
            self.due = self.booked = NEVER

    def _activate(self, at: int, began_at: int) -> None:
        """The activation that was due by `at`, or an input has moved to there, has run."""
        if at > self.due:
            self._come_back(at)
        self.has_run = True
        self.lateness = began_at - at
        self.due = at + self.period

    def _take_input(self, at: int, begun: int, sigma: int) -> None:
        """Book after an input that was handled from `begun` on."""
        if sigma == 0:
            self._is_answering = self._is_by_input = True
        else:
            self._replan(at + sigma if sigma < NEVER else NEVER, begun)

    def _book_after_input(self, at: int, ended: int, began_at: int, sigma: int) -> None:
        """Book after an event that an input has brought about."""
        if sigma == 0:
            return
        booked = at + sigma if sigma < NEVER else NEVER
        if self._is_answering:
            self._is_answering = False
            self._replan(booked, ended)
            return
        self.booked = booked
        is_activation = at < self.due and booked == at + self.period
        if booked < self.due and not is_activation:  # a phase of what the input began
            return
        self._is_by_input = False
        if is_activation:  # it is what the input had moved to before the deadline
            if self.due <= self._moved_at:
                self.coalesced += 1
            self._activate(at, began_at)
            self._slip, self._moved_at = 0, NEVER
        else:
            self._move(booked, self._moved_at)

    def _come_back(self, at: int) -> None:
        """The model was not active at its deadline, and is now."""
        missed, slip = divmod(at - self.due, self.period)
        self._slip += slip
        if self._slip >= self.period:
            self._slip -= self.period
            missed += 1
        self._came_back_after = at - self.due + self.period
        if missed > 0:
            self.miss(missed)

    def _replan(self, booked: int, begun: int) -> None:
        """An input that was handled from `begun` on has the model book another instant."""
        before, due = self.booked, self.due
        self.booked = booked
        if booked == before:
            pass
        elif booked < due < NEVER:
            self._moved_at = begun
        else:
            self._move(booked, begun)
        self._is_by_input = self._moved_at != NEVER

    def _move(self, booked: int, begun: int) -> None:
        """The next deadline is `booked`; what had passed at `begun`, of the input, is coalesced."""
        due = self.due
        if due <= begun and booked > due:
            in_time = -(-(booked - due) // self.period)
            self.coalesced += min((begun - due) // self.period + 1, in_time)
        if booked != due:
            self.due, self._slip = booked, 0
        self._moved_at = NEVER

    def is_to_skip(self) -> bool:
        """Whether it is through with a period, and whole ones are to be dropped."""
        step = self._step
        has_acted = step.began_at[self.number] >= step.started
        return self.skips and has_acted and self.due <= self.booked

    def skip_to(self, now: int) -> int:
        """Drop every activation booked before `now`; return when the next is due, in phase."""
        missed = -(-(now - self.booked) // self.period)
        self.due += missed * self.period
        self.booked += missed * self.period
        self.skip(missed)
        return self.booked

    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped, and the last activation's time: it is over."""
        if self.due <= now:
            self.skip((now - self.due) // self.period + 1)
        if self.run > 0:
            self.own_time.record(self.spent)
        self.due = NEVER
        self.write()
