"""The account of a model without a period.

Its activations are its events: instants booked ahead of time, by a positive time advance. That
instant is the deadline. A booking that an input moves before it is due never was one, and one that
still stands after an input was answered in zero time has not been moved. What a model
does without having booked it, answering an input at the input's own instant, is a reaction: it has
no deadline of its own, so no lateness either, but its own time counts.
"""

from collections.abc import Callable
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


class EventAccount(ModelAccount):
    """Counts the booked events of one model, and its reactions."""

    __slots__ = ("_put_off",)
    kind = "event"

    def __init__(
        self, atomic: Atomic, path: str, number: int, policy: ActivationPolicy, tolerance: int
    ) -> None:
        super().__init__(atomic, path, number, policy, tolerance)
        self._put_off = NEVER
        """A deadline that has passed, while an input from before it is answered in zero time."""

    def watch(self, functions: Functions, step: Step, touched: list[ModelAccount]) -> Functions:
        """Wrap the model's functions; an account with something to count joins `touched`."""
        atomic, number, began_at = self.atomic, self.number, step.began_at

        def book() -> None:
            """Note the instant the model books with its present time advance."""
            sigma = atomic.sigma
            if sigma.__class__ is not int:
                sigma = plain_time_advance(atomic)
            self.due = step.at + sigma if 0 < sigma < NEVER else NEVER
            if self.noted == NOTHING:
                self.noted = TOOK_PART
                touched.append(self)

        def due(transition: Callable[[], None]) -> Callable[[], None]:
            def call() -> None:
                transition()
                has_run = self.due == step.at
                book()
                if self._put_off != NEVER:
                    self._replan(self._put_off)
                if has_run:
                    self.noted = RAN
                    self.lateness = began_at[number] - step.at

            return call

        def external(elapsed: int) -> None:
            begun, booked = step.lap, self.due
            functions.external(elapsed)
            book()
            if booked <= begun and booked != self.due:
                self._replan(booked)

        return replace(
            functions,
            internal=due(functions.internal),
            external=external,
            confluent=due(_confluent(functions)),
        )

    def _replan(self, passed: int) -> None:
        """An input from before a deadline that has passed has the model book, or go on at once."""
        if self.atomic.sigma == 0:
            self._put_off = passed
        else:
            self.coalesced += passed != self.due
            self._put_off = NEVER

    def settle(self, at: int, own_time: int) -> bool:
        """Count what the step at instant `at` has left; return whether an event ran."""
        ran = self.noted == RAN
        self.noted = NOTHING
        self.own_time.record(own_time)
        if ran:
            self.count_run(at)
        else:
            self.count_reaction()
        self.write()
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
