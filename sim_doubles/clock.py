"""Clocks of doubles: functions that return nanoseconds."""

from collections.abc import Callable
from typing import TypeAlias

Now: TypeAlias = Callable[[], int]
"""The present instant in ns; never goes back."""


class ManualClock:
    """A clock that stands still until `advance` is called; for tests."""

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

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""
        self._at = max(self._at, at)


class FollowingClock:
    """Follows another clock, such as a simulator's `now`, and runs ahead of it by wire time.

    For models on doubles without an executive: the doubles live on it, and it is the `time` of an
    `AccountedBus`.
    """

    def __init__(self, now: Now) -> None:
        self._now = now
        self._reached = 0

    def __call__(self) -> int:
        """Return the present instant."""
        return max(self._now(), self._reached)

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""
        self._reached = max(self._reached, at)

    def elapsed(self) -> int:
        """Return how far it runs ahead."""
        return self() - self._now()
