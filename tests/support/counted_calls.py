"""A virtual clock that counts the calls of Python functions between two of its waits."""

import sys
from collections import Counter
from collections.abc import Callable, Sequence
from types import FrameType

from firmware_runtime.executive.clocks import S, VirtualClock


class CountingClock(VirtualClock):
    """`passes` has the calls from instant `since` on, by what `key` says of a frame; None is none.

    Whoever runs it ends the count by `sys.setprofile(None)`.
    """

    def __init__(self, since: int, key: Callable[[FrameType], str | None]) -> None:
        super().__init__()
        self.passes: list[Counter[str]] = []
        self._since = since
        self._key = key

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Begin another pass."""
        sys.setprofile(None)
        ready = super().wait(until, sources)
        if self.now() >= self._since:
            self.passes.append(Counter())
            sys.setprofile(self._count)
        return ready

    def _count(self, frame: FrameType, event: str, _argument: object) -> None:
        key = self._key(frame) if event == "call" else None
        if key is not None:
            self.passes[-1][key] += 1
