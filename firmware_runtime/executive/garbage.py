"""Garbage collection: how long it took, and how to have it between the steps only."""

import gc
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

from firmware_runtime.devs.time import MILLISECOND

YOUNG = 1_000
"""Objects made and not freed since the last collection, from which on one is worth while."""
TOO_MANY = 200_000
"""The same, from which on memory matters more than the next deadline."""
RESERVE = MILLISECOND
EVERY_NTH_IS_FULL = 16


class GarbageTime:
    """Adds up the time spent in collections: `spent`, ns, since a reader last set it to zero."""

    def __init__(self, now: Callable[[], int]) -> None:
        self.spent = 0
        self._now = now
        self._started = 0

    @contextmanager
    def measured(self) -> Iterator[None]:
        """Within the block, every collection counts."""
        gc.callbacks.append(self._note)
        try:
            yield
        finally:
            gc.callbacks.remove(self._note)

    def _note(self, phase: str, _info: Mapping[str, int]) -> None:
        if phase == "start":
            self._started = self._now()
        else:
            self.spent += self._now() - self._started


class SlackCollector:
    """Collects garbage between two steps when the time left is enough by all experience.

    Enough is twice the longest collection so far, and a millisecond. Every 16th collection is a
    full one, the others young ones; what was frozen before the run is left out.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self._longest = 0
        self._collections = 0

    def offer(self, left: int) -> None:
        """Use the `left` ns to the next event, if there is enough to collect and enough time."""
        objects = gc.get_count()[0]
        if objects < YOUNG or (left < 2 * self._longest + RESERVE and objects < TOO_MANY):
            return
        self._collections += 1
        started = self._now()
        gc.collect(2 if self._collections % EVERY_NTH_IS_FULL == 0 else 1)
        self._longest = max(self._longest, self._now() - started)
