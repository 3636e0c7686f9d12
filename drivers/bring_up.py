"""Walks through a chip's bring-up, one step an activation, so that no call sleeps."""

from collections.abc import Callable, Generator, Iterable, Iterator

from drivers.chips.shared_bring_up import SharedBringUp
from drivers.chips.step import Step

RETRY_AFTER = 100_000_000
"""Ns to wait before a bring-up that failed is begun again."""


class BringUp:
    """The steps of one chip; `take` carries out the next and says how long to wait after it."""

    def __init__(self, steps: Callable[[], Iterable[Step]]) -> None:
        self._begin = steps
        self._steps: Iterator[Step] = iter(())
        self.step = ""

    def restart(self) -> None:
        """Begin again with the first step; steps that were under way are given up."""
        if isinstance(self._steps, Generator | SharedBringUp):
            self._steps.close()
        self._steps = iter(self._begin())

    def take(self) -> int | None:
        """Carry out the next step; return ns to wait after it, or None when all are done.

        Raises HalError if the step failed; the next call then begins again.
        """
        step = next(self._steps, None)
        if step is None:
            return None
        self.step = step.name
        try:
            step.action()
        except BaseException:
            self.restart()
            raise
        return step.wait_ns


def failed_in_a_row(times: int) -> str:
    """Say in words how a device failed whose last transactions did."""
    return "has failed" if times == 1 else f"has failed {times} times in a row"
