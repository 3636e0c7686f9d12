"""The account of a periodic model where functions take no time: in virtual time.

The clock stands still while a step is worked off, so every own time is zero and nothing is late.
This account counts what the other counts, without reading the clock around each function; the
model's output function is called as it is. It counts in itself alone, as an `UntimedEventAccount`.
"""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.account import NOTHING, RAN
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.executive.untimed_account import copy_block
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout


class UntimedPeriodicAccount(PeriodicAccount):
    """A `PeriodicAccount` on a clock that stands still during a step."""

    __slots__ = ("output",)

    output: Callable[[], None]  # the model's own, without a frame around

    def __init__(
        self, atomic: Atomic, functions: Functions, step: Step, policy: ActivationPolicy
    ) -> None:
        super().__init__(atomic, functions, step, policy)
        self.output = functions.output

    def internal(self) -> None:
        """Have the model make its internal transition: an activation, or a phase of one."""
        step = self._step
        step.began_at[self.number] = step.lap
        transit = self._call_internal
        transit()
        at = step.at
        if at >= self.due:
            self._activate(at)
        else:
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

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """Go on counting in itself."""

    def settle(self, at: int, own_time: int) -> bool:  # noqa: ARG002 -- one instant, and zero
        """Count what the step has left; return whether an activation ran."""
        ran = self.noted == RAN
        self.noted = NOTHING
        if ran:
            self.run += 1
            self.in_episode = False
            if self._came_back_after > 0:
                self.count_irregular(self._came_back_after)
                self._came_back_after = 0
        self.is_in_period = self.booked < self.due and self._moved_at == NEVER
        return ran

    def copy_into(self, cells: Cells, layout: Layout) -> None:
        """Write the model's block; the time of the last activation is known at the end only."""
        last = self.own_time.buckets[0]  # `end` has recorded it
        copy_block(self, cells, layout, max(self.run - 1, 0) + last)

    def _confluent(self, confluent: Callable[[], None]) -> None:
        self._step.began_at[self.number] = self._step.lap
        super()._confluent(confluent)
