"""How values from outside reach the model: sources the loop reads, and an inbox to post to.

A source has a descriptor. While the loop waits it waits for all of them too (one `select`), reads
those that became readable, and stamps what it gets with the present instant; events that came
apart and are read together get an instant each, a nanosecond after the one before. The inbox is the
source for everything that has no descriptor: other threads, signal handlers, tests. Posting stamps
the value and rings, which ends the loop's wait.

What has arrived waits in `Arrivals`, and is handled in the order of arrival, each value at its own
instant: see `loop`.
"""

import weakref
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from heapq import heappop, heappush
from typing import Any, Protocol, TypeAlias, TypeVar

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.system.resources import WakeUp

T = TypeVar("T")

Bag: TypeAlias = Sequence[tuple[InPort[Any], object]]
"""Values for input ports of the root model that arrive as one event, at one instant."""
Arrival: TypeAlias = tuple[int, InPort[Any], object]
"""When something arrived, for which input port of the root model, and what."""

CAPACITY = 1024
"""How many posted values may wait before further ones are dropped."""


class Source(Protocol):
    """Something outside that values come from."""

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is something to receive."""

    def receive(self) -> Bag:
        """Whatever is there, without blocking: one event, at the instant of reading."""


class EventSource:
    """Something outside that events come from, each to be handled at an instant of its own."""

    def fileno(self) -> int:
        """The descriptor that becomes readable when there is something to receive."""
        raise NotImplementedError

    def events(self) -> Sequence[Bag]:
        """The events that are there, in their order, without blocking."""
        raise NotImplementedError


AnySource: TypeAlias = Source | EventSource


class Inbox:
    """Values posted from anywhere in this process, each with the instant at which it was posted."""

    def __init__(self, now: Callable[[], int]) -> None:
        self.dropped = 0
        self.is_woken = False
        """Whether the descriptor may be readable: once it is, this is True."""
        self._now = now
        self._posted: deque[Arrival] = deque()
        self._wake_up = WakeUp()
        self._descriptor = self._wake_up.fileno()
        self._release = weakref.finalize(self, self._wake_up.close)

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
        if self._release.alive:
            self._wake_up.ring()
        self.is_woken = True  # after it, as `take` does it before: none is forgotten

    def fileno(self) -> int:
        """The descriptor that is readable after a post or a wake."""
        return self._descriptor

    def close(self) -> None:
        """Release the descriptor: nothing waits any more."""
        self._release()

    def take(self) -> list[Arrival]:
        """Everything posted so far, in order."""
        self.is_woken = False
        self._wake_up.clear()
        posted = self._posted
        return [posted.popleft() for _ in range(len(posted))]


class Arrivals:
    """What has arrived from outside and has not been handled yet, in order of arrival.

    Reads the sources for the loop and keeps what they gave, each value with its instant.

    What is known beforehand can be planned; of one instant it is handled first.

    While `CAPACITY` values wait here no source is read: what comes then waits in the source, which
    drops what it cannot keep (a socket does so in the kernel).
    """

    def __init__(self, inbox: Inbox, sources: Sequence[Source]) -> None:
        self._inbox = inbox
        self.all: list[Inbox | AnySource] = [inbox, *sources]
        self.others: list[Inbox | AnySource] = [*sources]
        """All but the inbox, which says itself whether there is something in it."""
        self.waiting: deque[Arrival] = deque()
        """What has arrived, in order."""
        self.planned: list[tuple[int, int, InPort[object], object]] = []
        """What is planned, a heap."""
        self._plans = 0

    def sources(self, *, waits: bool) -> list[Inbox | AnySource]:
        """The sources to wait for now; of a clock that does not wait, those to ask.

        Those are none where there is but an empty inbox.
        """
        if len(self.waiting) >= CAPACITY:
            return []
        return self.all if waits or self._inbox.is_woken else self.others

    def add_source(self, source: AnySource) -> None:
        """Read one more source."""
        self.all.append(source)
        self.others.append(source)

    def receive(self, ready: Iterable[Inbox | AnySource], now: int) -> None:
        """Read the sources that became readable."""
        for source in ready:
            if isinstance(source, Inbox):
                # one posted before the run began has an instant of no meaning here
                arrived = [(min(at, now), port, value) for at, port, value in source.take()]
                self.waiting.extend(arrived)
            elif isinstance(source, EventSource):
                for bag in source.events():
                    at = max(now, self._latest + 1)
                    self.waiting.extend((at, port, value) for port, value in bag)
            else:
                at = max(now, self._latest)
                self.waiting.extend((at, port, value) for port, value in source.receive())

    @property
    def _latest(self) -> int:
        """The instant of the last that waits; before all others if nothing does."""
        return self.waiting[-1][0] if self.waiting else -1

    def plan(self, at: int, port: InPort[Any], value: object) -> None:
        """Let a value arrive at instant `at`; those of one instant in the order of planning."""
        self._plans += 1
        heappush(self.planned, (at, self._plans, port, value))

    def next_at(self, earliest: int) -> int:
        """The instant to handle the next value at, `earliest` at least; NEVER if none is there."""
        if self.planned:
            first = self.planned[0][0]
            return max(min(first, self.waiting[0][0]) if self.waiting else first, earliest)
        return max(self.waiting[0][0], earliest) if self.waiting else NEVER

    def take(self, at: int) -> Iterator[tuple[InPort[object], object]]:
        """Remove what arrived up to instant `at`."""
        while self.planned and self.planned[0][0] <= at:
            _, _, port, value = heappop(self.planned)
            yield port, value
        while self.waiting and self.waiting[0][0] <= at:
            _, port, value = self.waiting.popleft()
            yield port, value
