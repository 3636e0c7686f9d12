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

from collections.abc import Callable
from functools import partial

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import NOTHING, RAN, TOOK_PART, ModelAccount
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
    kept = (
        *(*ModelAccount.kept, "spent", "_slip", "_came_back_after"),
        *("_is_answering", "_is_by_input", "_moved_at"),
    )

    def __init__(
        self, atomic: Atomic, functions: Functions, step: Step, policy: ActivationPolicy
    ) -> None:
        tolerance = policy.tolerance(atomic.period)
        super().__init__(atomic, functions, step, policy, tolerance)
        if functions.confluent is not None:  # else the simulator calls internal, then external
            self.confluent = partial(self._confluent, functions.confluent)
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

    # In the model's place, during a step ---------------------------------------------------------

    def internal(self) -> None:
        """Have the model make its internal transition: an activation, or a phase of one."""
        step = self._step
        begun = step.lap
        transit, now = self._call_internal, self._now  # as locals, which CPython calls sooner
        transit()
        ended = step.lap = now()
        step.own_times[self.number] += ended - begun
        at = step.at
        if at == self.due and self.noted == NOTHING:  # as `_activate` would, without the call
            step.touched.append(self.number)
            self.noted = RAN
            self.lateness = step.began_at[self.number] - at
            self.due = at + self.period
        elif at >= self.due:
            self._activate(at)
        elif self.noted == NOTHING:
            self._take_part()
        sigma = self.sigma = self.atomic.sigma
        if sigma.__class__ is not int:
            sigma = self._plain_time_advance()
        if self._is_by_input:
            self._book_after_input(at, sigma)
        elif 0 < sigma < NEVER:
            self.booked = at + sigma
        elif sigma == NEVER:
            self.due = self.booked = NEVER

    def external(self, elapsed: int) -> None:
        """Have the model read its input, `elapsed` ns after its last transition."""
        step = self._step
        begun = step.lap
        transit, now = self._call_external, self._now
        transit(elapsed)
        ended = step.lap = now()
        step.own_times[self.number] += ended - begun
        for answer in self.answers:
            answer()
        self._take_part()
        self._answer(step.at, begun)

    def _confluent(self, confluent: Callable[[], None]) -> None:
        """Have the model do both, in its own way."""
        step = self._step
        begun = step.lap
        confluent()
        ended = step.lap = self._now()
        step.own_times[self.number] += ended - begun
        for answer in self.answers:
            answer()
        at = step.at
        self._take_part()
        if at >= self.due:
            self._activate(at)
            self.booked = self.due
        self._answer(at, at)

    def _take_part(self) -> None:
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            self._step.touched.append(self.number)

    def _activate(self, at: int) -> None:
        """The activation that was due by `at`, or an input has moved to there, has run."""
        if at > self.due:
            self._come_back(at)
        if self.noted == NOTHING:
            self._step.touched.append(self.number)
        self.noted = RAN
        self.lateness = self._step.began_at[self.number] - at
        self.due = at + self.period

    def _answer(self, at: int, begun: int) -> None:
        """Book after an input that was handled from `begun` on."""
        sigma = self.sigma = self.atomic.sigma
        if sigma.__class__ is not int:
            sigma = self._plain_time_advance()
        if sigma == 0:
            self._is_answering = self._is_by_input = True
        else:
            self._replan(at + sigma if sigma < NEVER else NEVER, begun)

    def _book_after_input(self, at: int, sigma: int) -> None:
        """Book after an event that an input has brought about."""
        if sigma == 0:
            return
        booked = at + sigma if sigma < NEVER else NEVER
        if self._is_answering:
            self._is_answering = False
            self._replan(booked, self._step.lap)
            return
        self.booked = booked
        is_activation = at < self.due and booked == at + self.period
        if booked < self.due and not is_activation:  # a phase of what the input began
            return
        self._is_by_input = False
        if is_activation:  # it is what the input had moved to before the deadline
            self.coalesced += self.due <= self._moved_at
            self._activate(at)
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
