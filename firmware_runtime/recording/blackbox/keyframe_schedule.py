"""When keyframes are due, and what keeps them from being taken.

One is due every 5 s, at the beginning of each chunk, and soon after a section that is missing, so
that what follows can be replayed. In real time it waits for a pause between two steps that is more
than three times as long as one takes, for beside a busy process one may take that long. Where there
is no such pause none is taken: no activation waits for a keyframe.

How long one takes is the longest attempt of late, of which a part is forgotten with time, so that
one that met a page fault or another process does not end keyframes; but never less than the
shortest of the last few, nor than what one took before the run. One that fails has taken as long;
the next is tried later and later.
"""

from collections import deque
from collections.abc import Callable
from time import monotonic_ns
from typing import Final, Protocol, TypeVar

from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from firmware_runtime.errors import text_of

T = TypeVar("T")

KEYFRAME_EVERY: Final = 5 * SECOND
KEYFRAME_AGAIN: Final = SECOND // 2
"""Ns until a keyframe is tried again that could not be taken; twice as long each time it fails."""
LONGEST_WAIT: Final = 60 * SECOND
"""Ns between two tries that fail, at most."""
RESERVE: Final = 200 * MICROSECOND
"""Ns to the next event without which no keyframe is taken, beside MARGIN times what one takes."""
MARGIN: Final = 3
_REMEMBERED: Final = 4
"""Attempts: what all of them took is not taken for an exception."""
_CACHE: Final = 2 << 20
"""Bytes: as much as the caches have that are a processor's own."""
_FORGOTTEN: Final = 4
"""One part in so many of what is beyond that is forgotten each half second."""

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
        self.cannot: str | None = None
        """Why there can be none as the run begins: the robot's state cannot be kept."""
        self._is_real_time = True
        self._make: Callable[[], Keyframes] | None = None
        self._keyframes: Keyframes | None = None
        self._attempts: deque[int] = deque(maxlen=_REMEMBERED)
        self._takes = 0
        self._usual = 0
        """What one took, of those before the run: the one in the middle."""
        self._forgets_at = 0
        self._failures = 0

    def plan(self, make: Callable[[], Keyframes], *, is_real_time: bool) -> None:
        """Take them with what `make` returns; in virtual time a keyframe makes nothing late."""
        self._make = make
        self._is_real_time = is_real_time

    def open(self, write: Callable[[bytes], object]) -> None:
        """The run begins, or goes on; its clock has not started.

        In real time some are captured and thrown away: how long one takes is known before the
        first. `write` does with a state what is done with one that is kept, and keeps nothing.
        """
        if self._make is None:
            return
        self._keyframes, self._make = self._able(self._make), None
        if (keyframes := self._keyframes) is None:
            self.cannot = self.fault
        elif self._is_real_time:
            for _ in range(_REMEMBERED):
                _ = b"\1" * _CACHE  # in a run, too, nothing of it is in the processor's caches
                before = monotonic_ns()
                self._able(lambda: write(keyframes.capture()))
                self._note(monotonic_ns() - before)
            self._takes = self._usual = sorted(self._attempts)[_REMEMBERED // 2]
            self.cannot = self.fault

    def has_time(self, now: int, left: int) -> bool:
        """Whether there are keyframes, and the `left` ns from `now` on are enough for one."""
        if self._keyframes is None:
            return False
        if left >= MARGIN * self._takes + RESERVE or not self._is_real_time:
            return True
        self.fault = _NO_TIME
        if now >= self._forgets_at:
            self._forgets_at = now + KEYFRAME_AGAIN
            self._forget()
        return False

    def capture(self, now: int) -> bytes | None:
        """The state, now; None if it cannot be had, and the next is due later."""
        self.due_at = now + KEYFRAME_AGAIN
        if self._keyframes is None:
            return None
        before = monotonic_ns()
        state = self._able(self._keyframes.capture)
        if state is None:
            self.failed(now, monotonic_ns() - before)
        else:
            self.fault = None
        return state

    def largest(self) -> str:
        """The field that takes most of the state; empty where there is none."""
        return "" if self._keyframes is None else self._able(self._keyframes.largest) or ""

    def taken(self, now: int, spent: int, *, is_large: bool = False) -> None:
        """One has been taken and written, which took `spent` ns.

        After a large one the next is due with the next chunk, so that they do not take all of it.
        """
        self._note(spent)
        self._failures = 0
        self.due_at = NEVER if is_large else now + KEYFRAME_EVERY

    def failed(self, now: int, spent: int) -> None:
        """One could not be taken, or not be written, which took `spent` ns all the same."""
        self._note(spent)
        self.due_at = now + min(KEYFRAME_AGAIN << self._failures, LONGEST_WAIT)
        self._failures = min(self._failures + 1, LONGEST_WAIT.bit_length())

    def hasten(self, at: int) -> None:
        """Something is missing in the recording at this instant: let the next one come soon."""
        self.due_at = min(self.due_at, at + KEYFRAME_AGAIN)

    # ---------------------------------------------------------------------------------------------

    def _note(self, spent: int) -> None:
        """Another attempt has taken so long."""
        self._attempts.append(spent)
        self._forget()
        self._takes = max(self._takes, spent)

    def _forget(self) -> None:
        """Take one part less for needed of what is beyond the usual and the shortest of late."""
        least = max(min(self._attempts), self._usual)
        beyond = max(self._takes - least, 0)
        self._takes = least + beyond - beyond // _FORGOTTEN

    def _able(self, function: Callable[[], T]) -> T | None:
        """What a function returns; None if the robot's state cannot be kept as it is now."""
        try:
            return function()
        except Exception as error:  # noqa: BLE001 -- the run goes on without a keyframe
            self.fault = text_of(error) or type(error).__name__
            return None
