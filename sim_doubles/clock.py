"""What time it is for a double: a function that returns nanoseconds."""

from collections.abc import Callable
from typing import TypeAlias

Now: TypeAlias = Callable[[], int]
"""The present instant in ns; never goes back."""


class ManualClock:
    """A clock that stands still until it is told to advance; for tests."""

    def __init__(self, at: int = 0) -> None:
        self._at = at

    def __call__(self) -> int:
        """Return the present instant."""
        return self._at

    def advance(self, span: int) -> None:
        """Let `span` ns pass. Raises ValueError when it is negative."""
        if span < 0:
            raise ValueError(f"manual clock: advanced by {span} ns, expected 0 or more")
        self._at += span
