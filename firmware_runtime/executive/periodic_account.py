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

from dataclasses import replace

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import (
    NOTHING,
    RAN,
    TOOK_PART,
    ModelAccount,
    plain_time_advance,
)
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step


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

    def __init__(self, atomic: Atomic, path: str, number: int, policy: ActivationPolicy) -> None:
        super().__init__(atomic, path, number, policy, policy.tolerance(atomic.period))
        self.period = atomic.period
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

    # During a step ------------------------------------------------------------------------------

    def watch(  # noqa: C901 -- written out: a call more for each transition would be felt
        self, functions: Functions, step: Step, touched: list[ModelAccount]
    ) -> Functions:
        """Wrap the model's functions; an account with something to count joins `touched`."""
        atomic, number, began_at, period = self.atomic, self.number, step.began_at, self.period

        def internal() -> None:
            functions.internal()
            at = step.at
            if at >= self.due:
                if at > self.due:
                    self._come_back(at)
                if self.noted == NOTHING:
                    touched.append(self)
                self.noted = RAN
                self.lateness = began_at[number] - at
                self.due = at + period
            elif self.noted == NOTHING:
                self.noted = TOOK_PART
                touched.append(self)
            sigma = atomic.sigma
            if sigma.__class__ is not int:
                sigma = plain_time_advance(atomic)
            if self._is_by_input:
                self._book_after_input(step, sigma)
            elif 0 < sigma < NEVER:
                self.booked = at + sigma
            elif sigma == NEVER:
                self.due = self.booked = NEVER

        def external(elapsed: int) -> None:
            begun = step.lap
            functions.external(elapsed)
            self._take_part(touched)
            self._answer(step.at, begun)

        own_confluent = functions.confluent
        if own_confluent is None:  # the simulator calls internal and external, as above
            return replace(functions, internal=internal, external=external)

        def confluent() -> None:
            own_confluent()
            self._take_part(touched)
            at = step.at
            if at >= self.due:
                if at > self.due:
                    self._come_back(at)
                self._activate(at, began_at[number])
                self.booked = self.due
            self._answer(at, at)

        return replace(functions, internal=internal, external=external, confluent=confluent)

    def _take_part(self, touched: list[ModelAccount]) -> None:
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            touched.append(self)

    def _activate(self, at: int, began_at: int) -> None:
        """The activation that is due at `at`, or was moved there, has run."""
        self.noted = RAN
        self.lateness = began_at - at
        self.due = at + self.period

    def _answer(self, at: int, begun: int) -> None:
        """Book after an input that was handled from `begun` on."""
        sigma = self.atomic.sigma
        if sigma.__class__ is not int:
            sigma = plain_time_advance(self.atomic)
        if sigma == 0:
            self._is_answering = self._is_by_input = True
        else:
            self._replan(at + sigma if sigma < NEVER else NEVER, begun)

    def _book_after_input(self, step: Step, sigma: int) -> None:
        """Book after an event that an input has brought about."""
        if sigma == 0:
            return
        at = step.at
        booked = at + sigma if sigma < NEVER else NEVER
        if self._is_answering:
            self._is_answering = False
            self._replan(booked, step.lap)
            return
        self.booked = booked
        is_activation = at < self.due and booked == at + self.period
        if booked < self.due and not is_activation:  # a phase of what the input began
            return
        self._is_by_input = False
        if is_activation:  # it is what the input had moved to before the deadline
            self.coalesced += self.due <= self._moved_at
            self._activate(at, step.began_at[self.number])
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

    # After it -----------------------------------------------------------------------------------

    def settle(self, at: int, own_time: int) -> bool:
        """Count what the step at instant `at` has left; return whether an activation ran."""
        ran = self.noted == RAN
        self.noted = NOTHING
        if not ran:
            self.spent += own_time
        else:
            if self.run > 0:
                self.own_time.record(self.spent)
            self.spent = own_time
            if self.lateness > self.tolerance:
                self.count_run(at)
            else:  # the same, without a call: this is every activation of a good run
                self.run += 1
                self.late_by.record(self.lateness)
                self.in_episode = False
            if self._came_back_after > 0:
                self.count_irregular(self._came_back_after)
                self._came_back_after = 0
        self.is_in_period = self.booked < self.due and self._moved_at == NEVER
        self.write()
        return ran

    def is_to_skip(self, step: Step) -> bool:
        """Whether it is through with a period, and whole ones are to be dropped."""
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
