"""One step of a chip's bring-up: do something, then leave the chip alone for a while.

A driver never waits. What needs time is a tuple of steps, and their runner, a DEVS model with one
phase a step, decides what waiting means:

    for step in chip.bring_up():
        step.action()
        ...let step.wait_ns pass...

A step that raises has not happened; run the whole bring-up again, not the step.
"""

from collections.abc import Callable, Iterable
from typing import NamedTuple


class Step(NamedTuple):
    """A name for people, at most a few short transactions, and the wait the chip needs after."""

    name: str
    action: Callable[[], None]
    wait_ns: int


def duration_ns(steps: Iterable[Step]) -> int:
    """Sum of the waits: how long the steps take, bus time apart."""
    return sum(step.wait_ns for step in steps)
