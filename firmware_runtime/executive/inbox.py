"""How values from outside reach the model: sources the loop reads, and an inbox anybody posts to.

A source has a descriptor. While the loop waits it waits for all of them too (one `select`), reads
those that became readable, and stamps what it gets with the present instant. The inbox is the
source for everything that has no descriptor: other threads, signal handlers, tests. Posting stamps
the value and writes to an event descriptor, which ends the loop's wait.

What has arrived is handled in the order of arrival, each value at its own instant: see `loop`.
"""

import os
import weakref
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, Protocol, TypeAlias, TypeVar

from firmware_runtime.devs.ports import InPort

T = TypeVar("T")

Arrival: TypeAlias = tuple[int, InPort[Any], object]
"""When something arrived, for which input port of the root model, and what."""

CAPACITY = 1024
"""How many posted values may wait before further ones are dropped."""


class Source(Protocol):
    """Something outside that values come from."""

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is something to receive."""

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """Whatever is there, without blocking: ports of the root model, and values for them."""


class Inbox:
    """Values posted from anywhere in this process, each with the instant at which it was posted."""

    def __init__(self, now: Callable[[], int]) -> None:
        self.dropped = 0
        self._now = now
        self._posted: deque[Arrival] = deque()
        self._wake_up = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        weakref.finalize(self, os.close, self._wake_up)

    def post(self, port: InPort[T], value: T) -> bool:
        """Hand a value to an input port of the root model; never blocks.

        Returns False, and counts the value as dropped, when `CAPACITY` values already wait.
        """
        if len(self._posted) >= CAPACITY:
            self.dropped += 1
            return False
        self._posted.append((self._now(), port, value))
        self.wake()
        return True

    def wake(self) -> None:
        """End the loop's wait; safe in a signal handler."""
        os.eventfd_write(self._wake_up, 1)

    def fileno(self) -> int:
        """The descriptor that is readable after a post or a wake."""
        return self._wake_up

    def take(self) -> list[Arrival]:
        """Everything posted so far, in order."""
        with suppress(BlockingIOError):  # nobody woke us
            os.eventfd_read(self._wake_up)
        posted = self._posted
        return [posted.popleft() for _ in range(len(posted))]
