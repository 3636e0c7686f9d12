"""The bring-up of a chip that several models drive: one carries it out, the others wait.

An iterator that can say where it is, not a generator: so it can be kept and set back in the middle
of a bring-up.
"""

from collections.abc import Callable, Iterator
from typing import Any, Final

from firmware_drivers.chips.step import Step

POLL_NS: Final = 1_000_000
"""Between two polls of a model whose chip another one brings up."""


def nothing() -> None:
    """Do nothing: a step that only waits."""


class Turn:
    """Number of the bring-up that a chip goes through at present; 0 if none."""

    def __init__(self) -> None:
        self.holder = 0
        self._numbers = 0

    def number(self) -> int:
        """A number for another bring-up."""
        self._numbers += 1
        return self._numbers


class SharedBringUp(Iterator[Step]):
    """Steps for one of several models, once no other model's are under way.

    A chip that does not run yet gets the steps of `bring_up`, and the others wait; one that runs
    those of `verify`, which leave the others alone. `close` gives up the steps under way.
    """

    def __init__(
        self,
        turn: Turn,
        is_running: Callable[[], bool],
        bring_up: Callable[[], tuple[Step, ...]],
        verify: Callable[[], tuple[Step, ...]],
    ) -> None:
        self._turn = turn
        self._number = turn.number()
        self._is_running, self._bring_up, self._verify = is_running, bring_up, verify
        self._steps: tuple[Step, ...] | None = None
        self._is_whole = False
        self._taken = 0

    def __next__(self) -> Step:
        """Return the next step, which waits as long as another model has its turn."""
        if self._steps is None:
            if self._turn.holder:
                return Step("wait for the others", nothing, POLL_NS)
            self._begin(is_whole=not self._is_running())
            if self._is_whole:
                self._turn.holder = self._number
        steps = self._steps or ()
        if self._taken >= len(steps):
            self.close()
            raise StopIteration
        self._taken += 1
        return steps[self._taken - 1]

    def close(self) -> None:
        """Take no more steps, and let the others have their turn."""
        self._steps, self._taken = (), 0
        if self._turn.holder == self._number:
            self._turn.holder = 0

    def restart(self) -> None:
        """Begin again with the first step, once no other model has its turn."""
        self.close()
        self._steps = None

    def state(self) -> dict[str, Any]:
        """Return its place among its steps."""
        begun = None if self._steps is None else self._is_whole
        is_closed = self._steps == ()
        return {
            "number": self._number,
            "whole": begun,
            "taken": self._taken,
            "closed": is_closed,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Be there again."""
        self._number, whole, is_closed = state["number"], state["whole"], state["closed"]
        self._steps = None
        if whole is not None:
            self._begin(is_whole=whole)
        if is_closed:
            self._steps = ()
        self._taken = state["taken"]

    def _begin(self, *, is_whole: bool) -> None:
        self._is_whole = is_whole
        self._steps = self._bring_up() if is_whole else self._verify()
