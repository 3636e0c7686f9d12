"""A step that is to be explained, and the time that buses took."""

from collections.abc import Sequence
from typing import Protocol

from msgspec import Struct


class Metered(Protocol):
    """A bus whose time is taken after each step; `executive.ledger.BusMeter` has it."""

    spent: list[int]

    @property
    def busy_ns(self) -> int:
        """Time on the wire so far."""

    @property
    def retries(self) -> int:
        """Attempts made again so far."""

    def addresses(self) -> list[int]:
        """Return those of the devices in `spent`, filled up with zeros."""


class Late(Struct, frozen=True):
    """What the loop knows of a step that is to be explained; times in ns.

    `behind` and `wake` lie before it, `step` is how long it took, `usual_step` how long one takes.
    It took its models `own_times` and each bus's devices `spent`, it was `beyond` the usual, and
    the run had made so many `steps`.
    """

    ended: int
    behind: int
    wake: int
    step: int
    usual_step: int
    garbage: int
    previous_end: int
    own_times: Sequence[int] = ()
    spent: Sequence[Sequence[int]] = ()
    beyond: int = 0
    steps: int = 0

    @property
    def in_step(self) -> int:
        """What the step took longer than is usual."""
        return max(self.step - self.usual_step, 0)

    @property
    def of(self) -> int:
        """What is to be explained: the lateness, and that."""
        return self.behind + self.wake + self.in_step
