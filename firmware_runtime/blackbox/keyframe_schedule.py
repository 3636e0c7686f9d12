"""When keyframes are due, and what keeps them from being taken.

One is due every 5 s, at the beginning of each chunk, and soon after a section that is missing, so
that what follows can be replayed. In real time it waits for a pause between two steps that is long
enough.
"""

from collections.abc import Callable
from time import monotonic_ns
from typing import Final, Protocol, TypeVar

from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from firmware_runtime.errors import text_of

T = TypeVar("T")

KEYFRAME_EVERY: Final = 5 * SECOND
KEYFRAME_AGAIN: Final = SECOND // 2
"""Ns until a keyframe is tried again that could not be taken."""
RESERVE: Final = 200 * MICROSECOND
"""Ns to the next event without which no keyframe is taken, beside twice the longest so far."""


_NO_TIME: Final = "it takes longer than there was until the next event"


class Keyframes(Protocol):
    """The state of the whole robot; `state.keyframes` has it."""

    def capture(self) -> bytes:
        """All of it, now."""

    def largest(self) -> str:
        """The path of the field that takes most of it."""


class KeyframeSchedule:
    """Of one run; `due_at` is when the next one is due, ns.

    `fault` says why the last that was due could not be taken; a chip may be coming up.
    """

    def __init__(self) -> None:
        self.due_at = 0
        self.fault: str | None = None
        self._is_real_time = True
        self._make: Callable[[], Keyframes] | None = None
        self._keyframes: Keyframes | None = None
        self._longest = 0

    def plan(self, make: Callable[[], Keyframes], *, is_real_time: bool) -> None:
        """Take them with what `make` returns; in virtual time a keyframe makes nothing late."""
        self._make = make
        self._is_real_time = is_real_time

    def open(self) -> None:
        """The run begins, or goes on; its clock has not started.

        In real time one is captured and thrown away: how long it takes is known before the first.
        """
        if self._make is None:
            return
        self._keyframes, self._make = self._able(self._make), None
        if self._keyframes is not None and self._is_real_time:
            before = monotonic_ns()
            self._able(self._keyframes.capture)
            self._longest = monotonic_ns() - before

    def has_time(self, left: int) -> bool:
        """Whether there are keyframes, and `left` ns are enough for one."""
        if self._keyframes is None:
            return False
        if left >= 2 * self._longest + RESERVE or not self._is_real_time:
            return True
        self.fault = _NO_TIME
        return False

    def capture(self, now: int) -> bytes | None:
        """The state, now; None if it cannot be had, and the next is due soon."""
        self.due_at = now + KEYFRAME_AGAIN
        state = None if self._keyframes is None else self._able(self._keyframes.capture)
        if state is not None:
            self.fault = None
        return state

    def largest(self) -> str:
        """The field that takes most of the state; empty where there is none."""
        return "" if self._keyframes is None else self._able(self._keyframes.largest) or ""

    def taken(self, now: int, spent: int, *, is_large: bool = False) -> None:
        """One has been taken and written, which took `spent` ns.

        After a large one the next is due with the next chunk, so that they do not take all of it.
        """
        self._longest = max(self._longest, spent)
        self.due_at = NEVER if is_large else now + KEYFRAME_EVERY

    def hasten(self, at: int) -> None:
        """Something is missing in the recording at this instant: let the next one come soon."""
        self.due_at = min(self.due_at, at + KEYFRAME_AGAIN)

    def _able(self, function: Callable[[], T]) -> T | None:
        """What a function returns; None if the robot's state cannot be kept as it is now."""
        try:
            return function()
        except Exception as error:  # noqa: BLE001 -- the run goes on without a keyframe
            self.fault = text_of(error) or type(error).__name__
            return None
