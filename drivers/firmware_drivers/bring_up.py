"""Walks through a chip's bring-up, one step an activation, so that no call sleeps."""

from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any

from firmware_drivers.chips.shared_bring_up import SharedBringUp
from firmware_drivers.chips.step import Step

RETRY_AFTER = 100_000_000
"""Ns to wait before a bring-up that failed is begun again."""


class BringUp:
    """The steps of one chip; `take` carries out the next and says how long to wait after it.

    It can be kept and set back in the middle, unless a generator gives the steps.
    """

    def __init__(self, steps: Callable[[], Iterable[Step]]) -> None:
        self._begin = steps
        self._steps: Iterator[Step] = iter(())
        self._taken: int | None = None
        """Steps taken since it was begun; None while none are under way."""
        self.step = ""

    def restart(self) -> None:
        """Begin again with the first step; steps that were under way are given up."""
        if isinstance(self._steps, Generator | SharedBringUp):
            self._steps.close()
        self._steps, self._taken = iter(self._begin()), 0

    def take(self) -> int | None:
        """Carry out the next step; return ns to wait after it, or None when all are done.

        Raises HalError if the step failed; the next call then begins again.
        """
        step = next(self._steps, None)
        if step is None:
            self._taken = None
            return None
        self._taken = (self._taken or 0) + 1
        self.step = step.name
        try:
            step.action()
        except BaseException:
            self.restart()
            raise
        return step.wait_ns

    def state(self) -> dict[str, Any]:
        """Return the number of steps taken. Raises TypeError for a generator under way."""
        steps, taken = self._steps, self._taken
        shared = steps.state() if isinstance(steps, SharedBringUp) else None
        if isinstance(steps, Generator) and taken is not None:
            raise TypeError("a generator gives its steps; expected a tuple of them")
        return {"step": self.step, "taken": taken, "shared": shared}

    def restore(self, state: dict[str, Any]) -> None:
        """Be there again; no step is carried out."""
        self.step, self._taken, shared = state["step"], state["taken"], state["shared"]
        self._steps = iter(())
        if self._taken is not None or shared is not None:
            self._steps = iter(self._begin())
        if isinstance(self._steps, SharedBringUp):
            self._steps.restore(shared)
        else:
            for _ in range(self._taken or 0):
                next(self._steps, None)


def failed_in_a_row(times: int) -> str:
    """Say in words how a device failed whose last transactions did."""
    return "has failed" if times == 1 else f"has failed {times} times in a row"
