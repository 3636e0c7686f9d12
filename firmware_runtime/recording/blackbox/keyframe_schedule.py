"""When keyframes are due, and what keeps them from being taken.

One is due every 5 s, at the beginning of each chunk, and soon after a section that is missing, so
that what follows can be replayed. In real time it waits for a pause between two steps that is more
than three times as long as one takes, for beside a busy process one may take that long. Where there
is no such pause none is taken: no activation waits for a keyframe.

How long one takes is the longest attempt of late, of which a part is forgotten with time, so that
one that met a page fault or another process does not end keyframes; but never less than the
shortest of the last few, nor than what one took before the run. After a minute without an attempt
the last few say nothing any more: the computer may have been busy, which a try shows; after one
that made something late it is twice as long. One that fails has taken as long; the next is tried
later and later.

It warns early, and once each, that keyframes grow or are missing: later the run cannot be replayed.
A state that grows without bound, such as a list that a model only appends to, takes more and more
of the recording, until no chunk has room for it or there is no time to write it down. The recording
stays of use until its last keyframe has been written over, which may be hours later.
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
        self._tried_at = self._had = 0
        """When one was tried last, and how long it had until the next event."""
        self._patience = LONGEST_WAIT
        """Ns without an attempt after which the last few say nothing any more."""
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
            self._had = left
            return True
        self.fault = _NO_TIME
        if now >= self._forgets_at:
            self._forgets_at = now + KEYFRAME_AGAIN
            if now - self._tried_at >= self._patience:
                self._attempts.clear()
            self._forget()
        return False

    def capture(self, now: int) -> bytes | None:
        """The state, now; None if it cannot be had, and the next is due later."""
        self.due_at = now + KEYFRAME_AGAIN
        if self._keyframes is None:
            return None
        self._tried_at = now
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
        self._patience = 2 * self._patience if spent > self._had else LONGEST_WAIT
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
        least = max(min(self._attempts, default=0), self._usual)
        beyond = max(self._takes - least, 0)
        self._takes = least + beyond - beyond // _FORGOTTEN

    def _able(self, function: Callable[[], T]) -> T | None:
        """What a function returns; None if the robot's state cannot be kept as it is now."""
        try:
            return function()
        except Exception as error:  # noqa: BLE001 -- the run goes on without a keyframe
            self.fault = text_of(error) or type(error).__name__
            return None


MISSING: Final = 6 * KEYFRAME_EVERY
"""Ns without one, of a run that had one, after which it is said."""
LARGE: Final = 4
"""A keyframe of more than this part of a chunk is large."""


class KeyframeWarnings:
    """Of one run; `log` gets sentences.

    `largest` says which field takes most of the state; that takes as long as a keyframe does, so it
    is called only where there has just been time for one.
    """

    def __init__(self) -> None:
        self.log: Callable[[str], None] = lambda _: None
        self.largest: Callable[[], str] = str
        self._first_size = 0
        self._taken_at: int | None = None
        self._has_said_growth = self._has_said_missing = self._has_said_never = False

    def taken(self, now: int, size: int, *, is_large: bool) -> None:
        """A keyframe of so many bytes has been written."""
        self._taken_at = now
        self._has_said_missing = False
        self._first_size = self._first_size or size
        if is_large and size >= 2 * self._first_size and not self._has_said_growth:
            self._has_said_growth = True
            field = self.largest()
            most = f" (most of it {field})" if field else ""
            self.log(
                f"warning: the state has grown, a keyframe from {self._first_size} to {size} bytes"
                f"{most}: the recording reaches less far back, and this run cannot be "
                "replayed any more when no chunk has room for one"
            )

    def cannot(self, why: str) -> None:
        """None can be taken as the run begins."""
        if not self._has_said_never:
            self._has_said_never = True
            self.log(
                f"warning: the recording can have no keyframe: {why}; as long as that is so this "
                "run can be replayed from its start only, and not once that is written over"
            )

    def missed(self, now: int, why: str | None, *, is_last_chunk: bool) -> None:
        """One was due and could not be taken; `is_last_chunk`: its start is written over next."""
        at = self._taken_at
        is_due = is_last_chunk if at is None else now >= at + MISSING
        if is_due and not self._has_said_missing:
            self._has_said_missing = True
            had = "no keyframe" if at is None else f"no keyframe since {at / SECOND:g} s"
            self.log(
                f"warning: the recording has {had}: {why}; this run cannot be replayed "
                "once what came before has been written over"
            )
