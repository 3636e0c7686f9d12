"""What has arrived from outside and has not been handled yet, in order of arrival."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from heapq import heappop, heappush
from typing import Any

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.inbox import CAPACITY, Arrival, Inbox, Source


class Arrivals:
    """Reads the sources for the loop and keeps what they gave, each value with its instant.

    What is known beforehand can be planned; of one instant it is handled first.

    While `CAPACITY` values wait here no source is read: what comes then waits in the source, which
    drops what it cannot keep (a socket does so in the kernel).
    """

    def __init__(self, inbox: Inbox, sources: Sequence[Source]) -> None:
        self._all: list[Inbox | Source] = [inbox, *sources]
        self._waiting: deque[Arrival] = deque()
        self._planned: list[tuple[int, int, InPort[Any], object]] = []
        self._plans = 0

    @property
    def sources(self) -> list[Inbox | Source]:
        """The sources to wait for now."""
        return self._all if len(self._waiting) < CAPACITY else []

    def add_source(self, source: Source) -> None:
        """Read one more source."""
        self._all.append(source)

    def receive(self, ready: Iterable[Inbox | Source], now: int) -> None:
        """Read the sources that became readable."""
        for source in ready:
            if isinstance(source, Inbox):
                # one posted before the run began has an instant of no meaning here
                arrived = [(min(at, now), port, value) for at, port, value in source.take()]
            else:
                arrived = [(now, port, value) for port, value in source.receive()]
            self._waiting.extend(arrived)

    def plan(self, at: int, port: InPort[Any], value: object) -> None:
        """Let a value arrive at instant `at`; those of one instant in the order of planning."""
        self._plans += 1
        heappush(self._planned, (at, self._plans, port, value))

    def next_at(self, earliest: int) -> int:
        """The instant to handle the next value at, `earliest` at least; NEVER if none is there."""
        if self._planned:
            first = self._planned[0][0]
            return max(min(first, self._waiting[0][0]) if self._waiting else first, earliest)
        return max(self._waiting[0][0], earliest) if self._waiting else NEVER

    def take(self, at: int) -> Iterator[tuple[InPort[Any], object]]:
        """Remove what arrived up to instant `at`."""
        while self._planned and self._planned[0][0] <= at:
            _, _, port, value = heappop(self._planned)
            yield port, value
        while self._waiting and self._waiting[0][0] <= at:
            _, port, value = self._waiting.popleft()
            yield port, value
