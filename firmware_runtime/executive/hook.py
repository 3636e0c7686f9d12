"""Whoever looks after a run between its steps: arming, the service's notices, the journal."""

from typing import Protocol


class Hook(Protocol):
    """Called by the loop when a step is over, and at least every 50 ms."""

    def attend(self, now: int, left: int) -> None:
        """Do what cannot wait; and what can, if it fits into the `left` ns to the next event."""
