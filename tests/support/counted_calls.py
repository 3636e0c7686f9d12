"""Clocks that count the calls of Python functions between two of their waits."""

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from types import FrameType
from typing import Any

from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.clocks import S, VirtualClock


class Counting:
    """Before a clock: `passes` has the calls from an instant on, by what `key` says of a frame.

    None is none. Whoever runs it ends the count by `sys.setprofile(None)`.
    """

    passes: list[Counter[str]]

    def __init__(self) -> None:
        super().__init__()
        self.passes = []
        self._since = NEVER
        self._key: Callable[[FrameType], str | None] = str

    def count(self, since: int, key: Callable[[FrameType], str | None]) -> None:
        """Count from an instant on."""
        self._since, self._key = since, key

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Begin another pass."""
        sys.setprofile(None)
        clock: Any = super()
        ready: list[S] = clock.wait(until, sources)
        if clock.now() >= self._since:
            self.passes.append(Counter())
            sys.setprofile(self._count)
        return ready

    def _count(self, frame: FrameType, event: str, _argument: object) -> None:
        key = self._key(frame) if event == "call" else None
        if key is not None:
            self.passes[-1][key] += 1


class CountingClock(Counting, VirtualClock):
    """In virtual time."""

    def __init__(self, since: int, key: Callable[[FrameType], str | None]) -> None:
        super().__init__()
        self.count(since, key)
