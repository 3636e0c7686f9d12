"""Memory of a motion, so that a sensor may report late what it measured before."""

from collections import deque
from typing import Final, Generic, Protocol, TypeVar

from firmware_runtime.devs.time import format_time

__all__ = ["KEPT", "Past", "require_in_order"]

KEPT: Final = 20_000
"""Number of stretches remembered; each step of a ramp begins one."""


class HasBegun(Protocol):
    """A stretch of a motion."""

    @property
    def since(self) -> int:
        """Return its begin, ns."""


S = TypeVar("S", bound=HasBegun)


class Past(Generic[S]):
    """The stretches of a motion, oldest first; of more than `KEPT` the oldest are forgotten."""

    def __init__(self) -> None:
        self._stretches: deque[S] = deque(maxlen=KEPT)

    def add(self, stretch: S) -> None:
        """Remember one that begins no earlier than the last."""
        self._stretches.append(stretch)

    def at(self, at: int) -> S:
        """The last one that had begun by an instant. Raises ValueError if it is forgotten."""
        for stretch in reversed(self._stretches):
            if stretch.since <= at:
                return stretch
        raise ValueError(
            f"arena: read at {format_time(at)}, expected an instant of the run no further back "
            f"than {KEPT} changes of a motion"
        )


def require_in_order(at: int, since: int) -> None:
    """Raise ValueError for a motion that would begin at `at`, before the last one, at `since`."""
    if at < since:
        raise ValueError(
            f"arena: advanced to {format_time(at)}, expected an instant not before the last "
            f"change at {format_time(since)}"
        )
