"""The tap: notes all that enters a run from the world, in order.

The loop calls it; what it does is its own (`blackbox`). A run without one costs nothing.
"""

from collections.abc import Callable
from typing import Any, Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.ports import InPort
from firmware_runtime.executive.outcome import Outcome


class Tap(Protocol):
    """Notes the readings of the clock within steps, what entered, where a run begins and ends."""

    def reading(self, now: Callable[[], int]) -> Callable[[], int]:
        """A clock as the steps read it, of which each reading is noted."""

    def instrument(self, atomic: Atomic, functions: Functions) -> Functions:
        """What to call for a model; for one of the robot's own that is what it was."""

    def begin(self, at: int) -> None:
        """A step for instant `at` begins."""

    def end(self, at: int, next_at: int) -> None:
        """The step has ended without an error and is counted; the next one is for `next_at`."""

    def entered(self, port: InPort[Any], value: object) -> None:
        """A value for an input port of the root is about to enter the step that has begun."""

    def go_on(self, until: int) -> None:
        """The run begins or goes on, to instant `until`."""

    def arm(self, *, armed: bool) -> None:
        """Outputs may be driven from now on, or may not."""

    def exit(self, exit_models: Callable[[], list[Exception]]) -> list[Exception]:
        """Call the models' exit; return what that returns."""

    def finish(self, outcome: Outcome, at: int) -> None:
        """The run is over, with its outputs made safe, at instant `at`."""
