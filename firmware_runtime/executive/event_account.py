"""The account of a model without a period.

Its activations are its events: instants booked ahead of time, by a positive time advance. That
instant is the deadline. A booking that an input moves before it is due never was one, and one that
still stands after an input was answered in zero time has not been moved. What a model
does without having booked it, answering an input at the input's own instant, is a reaction: it has
no deadline of its own, so no lateness either, but its own time counts.
"""

from collections.abc import Callable
from functools import partial

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import NOTHING, RAN, REACTIONS, TOOK_PART, ModelAccount
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step


class EventAccount(ModelAccount):
    """Counts the booked events of one model, and its reactions."""

    __slots__ = ("_put_off", "_written_due")
    kind = "event"
    kept = (*ModelAccount.kept, "_written_due", "_put_off")

    def __init__(
        self,
        atomic: Atomic,
        functions: Functions,
        step: Step,
        policy: ActivationPolicy,
        tolerance: int,
    ) -> None:
        super().__init__(atomic, functions, step, policy, tolerance)
        self.confluent = partial(self._confluent, _confluent(functions))
        self._written_due = 0
        """The deadline in the file; 0 where it may hold something else that has changed."""
        self._put_off = NEVER
        """A deadline that has passed, while an input from before it is answered in zero time."""

    # In the model's place, during a step ---------------------------------------------------------

    def internal(self) -> None:
        """Have the model make its internal transition; it was booked, or it is a reaction."""
        step = self._step
        begun = step.lap
        transit, now = self._call_internal, self._now  # as locals, which CPython calls sooner
        transit()
        ended = step.lap = now()
        step.own_times[self.number] += ended - begun
        self._book_after_event(step.at)

    def external(self, elapsed: int) -> None:
        """Have the model read its input, `elapsed` ns after its last transition."""
        step, booked = self._step, self.due
        begun = step.lap
        transit, now = self._call_external, self._now
        transit(elapsed)
        ended = step.lap = now()
        step.own_times[self.number] += ended - begun
        for answer in self.answers:
            answer()
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            step.touched.append(self.number)
        sigma = self.sigma = self.atomic.sigma
        if sigma.__class__ is not int:
            sigma = self._plain_time_advance()
        self.due = step.at + sigma if 0 < sigma < NEVER else NEVER
        if booked <= begun and booked != self.due:
            self._replan(booked)

    def _confluent(self, confluent: Callable[[], None]) -> None:
        """Have the model do both."""
        step = self._step
        begun = step.lap
        confluent()
        ended = step.lap = self._now()
        step.own_times[self.number] += ended - begun
        for answer in self.answers:
            answer()
        self._book_after_event(step.at)

    def _book_after_event(self, at: int) -> None:
        """Note what an internal or confluent transition was, and what the model books next."""
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            self._step.touched.append(self.number)
        if self.due == at:
            self.noted = RAN
            self.lateness = self._step.began_at[self.number] - at
        sigma = self.sigma = self.atomic.sigma
        if sigma.__class__ is not int:
            sigma = self._plain_time_advance()
        self.due = at + sigma if 0 < sigma < NEVER else NEVER
        if self._put_off != NEVER:
            self._replan(self._put_off)

    def _replan(self, passed: int) -> None:
        """An input from before a deadline that has passed has the model book, or go on at once."""
        if self.atomic.sigma == 0:
            self._put_off = passed
        else:
            self.coalesced += passed != self.due
            self._put_off, self._written_due = NEVER, 0

    # After it -----------------------------------------------------------------------------------

    def settle(self, at: int, own_time: int) -> bool:
        """Count what the step at instant `at` has left; return whether an event ran."""
        ran = self.noted == RAN
        self.noted = NOTHING
        self.own_time.record(own_time)
        if ran:
            self.count_run(at)
        else:
            self.reactions = self.cells[REACTIONS] = self.reactions + 1
            if self.due == self._written_due:
                return False
        self.write()
        self._written_due = self.due
        return ran

    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""
        if min(self.due, self._put_off) <= now:
            self.skip(1)
        self.due = NEVER
        self.write()


def _confluent(functions: Functions) -> Callable[[], None]:
    """The confluent function, also of a model that has the usual one."""

    def confluent() -> None:
        functions.internal()
        functions.external(0)

    return functions.confluent or confluent
