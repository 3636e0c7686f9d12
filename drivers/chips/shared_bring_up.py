"""The bring-up of a chip that several models drive: one carries it out, the others wait.

An iterator with its place in plain attributes, not a generator: so it can be kept and set back in
the middle of a bring-up.
"""

from collections.abc import Callable, Iterator
from typing import Final

from drivers.chips.step import Step

POLL_NS: Final = 1_000_000
"""Between two polls of a model whose chip another one brings up."""


def nothing() -> None:
    """Do nothing: a step that only waits."""


class Turn:
    """Whose bring-up a chip goes through at present, if any."""

    def __init__(self) -> None:
        self.holder: SharedBringUp | None = None


class SharedBringUp(Iterator[Step]):
    """Steps for one of several models; `begin` gives its own once no other model's are under way.

    It is given this bring-up and makes it the holder of the turn, unless its steps leave the others
    alone. `close` gives up the steps under way.
    """

    def __init__(self, turn: Turn, begin: "Callable[[SharedBringUp], tuple[Step, ...]]") -> None:
        self._turn = turn
        self._begin = begin
        self._steps: Iterator[Step] | None = None

    def __next__(self) -> Step:
        """Return the next step, which waits as long as another model has its turn."""
        if self._steps is None:
            if self._turn.holder is not None:
                return Step("wait for the others", nothing, POLL_NS)
            self._steps = iter(self._begin(self))
        step = next(self._steps, None)
        if step is None:
            self.close()
            raise StopIteration
        return step

    def close(self) -> None:
        """Take no more steps, and let the others have their turn."""
        self._steps = iter(())
        if self._turn.holder is self:
            self._turn.holder = None
