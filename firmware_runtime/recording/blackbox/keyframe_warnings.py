"""Says early, and once each, that keyframes grow or are missing: later the run cannot be replayed.

A state that grows without bound, such as a list that a model only appends to, takes more and more
of the recording, until no chunk has room for it or there is no time to write it down. The recording
stays of use until its last keyframe has been written over, which may be hours later.
"""

from collections.abc import Callable
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.keyframe_schedule import KEYFRAME_EVERY

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
