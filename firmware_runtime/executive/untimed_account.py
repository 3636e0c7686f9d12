"""The account of a model without a period where functions take no time: in virtual time.

The clock stands still while a step is worked off, so every own time is zero, nothing is late, and
no deadline passes before it is kept. This account counts what the other counts and leaves undone
what would come to nothing: reading the clock around each function of the model, and following what
it books within a step. What it has booked is seen when the step is over; and a model that took part
in a step at its deadline has run, since its internal transition comes first.
Nothing is recorded, so it is none for a flight recorder.
"""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import NOTHING, RAN, REACTIONS, TOOK_PART
from firmware_runtime.executive.event_account import EventAccount
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step


class UntimedEventAccount(EventAccount):
    """An `EventAccount` on a clock that stands still during a step."""

    __slots__ = ("output",)

    output: Callable[[], None]  # the model's own, without a frame around

    def __init__(
        self,
        atomic: Atomic,
        functions: Functions,
        step: Step,
        policy: ActivationPolicy,
        tolerance: int,
    ) -> None:
        super().__init__(atomic, functions, step, policy, tolerance)
        self.output = functions.output

    def _confluent(self, confluent: Callable[[], None]) -> None:
        self._step.began_at[self.number] = self._step.lap
        super()._confluent(confluent)

    def internal(self) -> None:
        """Have the model make its internal transition."""
        step = self._step
        step.began_at[self.number] = step.lap
        transit = self._call_internal
        transit()
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            step.touched.append(self.number)
        self.sigma = self.atomic.sigma

    def external(self, elapsed: int) -> None:
        """Have the model read its input."""
        transit = self._call_external
        transit(elapsed)
        for answer in self.answers:
            answer()
        if self.noted == NOTHING:
            self.noted = TOOK_PART
            self._step.touched.append(self.number)
        self.sigma = self.atomic.sigma

    def settle(self, at: int, own_time: int) -> bool:
        """Count what the step at instant `at` has left; return whether an event ran."""
        ran = self.noted == RAN or self.due == at
        self.noted = NOTHING
        sigma = self.sigma
        if sigma.__class__ is not int:
            sigma = self._plain_time_advance()
        due = self.due = at + sigma if 0 < sigma < NEVER else NEVER
        self.own_time.record(own_time)
        if ran:
            self.lateness = self._step.began_at[self.number] - at
            self.count_run(at)
        else:
            self.reactions = self.cells[REACTIONS] = self.reactions + 1
            if due == self._written_due:
                return False
        self.write()
        self._written_due = due
        return ran
