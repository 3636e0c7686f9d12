"""The writer: makes a section of what is pending, and puts it into the ring.

It makes no system call and waits for nothing, and whatever entered a run, the run goes on: a value
that cannot be written is written in words, a section that cannot be is said to be missing, and
where there is no room for more the recording ends.

What is pending has been recorded since the last section was written, in lists by kind. The lists
stay the same objects for as long as a run lasts: each tap keeps one, not its `append`, since
CPython does `list.append(value)` without a call. Within a step nothing else is done.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final

from firmware_runtime.devs.ports import Sent
from firmware_runtime.errors import text_of
from firmware_runtime.recording.blackbox.keyframe_schedule import KeyframeSchedule
from firmware_runtime.recording.blackbox.ring import Ring, SectionTooLarge
from firmware_runtime.recording.blackbox.section import Kind, encode, encode_in_words
from firmware_runtime.recording.classes import NotedClasses

AT: Final = 1
"""Place of the instant among the fields of a section."""
EXTRA: Final = -1
"""Place of what a section says beside its lists."""
NO_STEP: Final = -1
"""In the place of the instant of a step, between two steps."""
_STEP: Final = Kind.STEP.value


class Pending:
    """Lists as in `section.Section`; `fields` are these and all else of one, in its order."""

    __slots__ = (
        *("classes", "enabled", "entered", "fields", "lists", "readings", "sent", "times"),
        *("transfers", "world"),
    )

    def __init__(self) -> None:
        self.readings: list[int] = []
        self.times: list[int] = []
        self.enabled: list[bool] = []
        self.world: list[int] = []
        self.sent: Sent = []
        self.transfers: list[tuple[Any, ...]] = []
        self.entered: list[tuple[str, Any]] = []
        self.classes = NotedClasses(self.sent)
        self.lists = (
            *(self.readings, self.times, self.enabled, self.world),
            *(self.sent, self.transfers, self.entered),
        )
        self.fields: list[Any] = [_STEP, NO_STEP, *self.lists, None]
        """What is encoded when a step is over, a section without making one."""

    def __bool__(self) -> bool:
        return any(self.lists)

    @property
    def step_at(self) -> int:
        """Instant of the step that has not been written; NO_STEP: there is none."""
        at: int = self.fields[AT]
        return at

    def clear(self) -> None:
        """Forget everything: it has been written."""
        self.fields[AT] = NO_STEP
        for each in (*self.lists, self.classes.unlike):
            each.clear()


class Writer:
    """Writes what is `pending`; before there is a ring, into a list.

    `fault` says why something is missing.
    """

    def __init__(self, pending: Pending, schedule: KeyframeSchedule) -> None:
        self.early: list[bytes] = []
        """Sections from before there was a ring."""
        self.fault: str | None = None
        self._pending = pending
        self._schedule = schedule
        self.ring: Ring | None = None
        """What it writes into: shared memory."""
        self.is_kept = False
        """Whether there was a ring: what has been written into it stays."""
        self._put: Callable[[bytes], bool | None] = self.early.append
        """Where sections go; returns whether this one is the first of a chunk."""

    def open(self, make_ring: Callable[[], Ring | None]) -> None:
        """Make the ring, and write the sections from before; without one write nothing more."""
        ring = self.ring = make_ring()
        self.is_kept = ring is not None
        self._put = _drop if ring is None else ring.write
        for content in self.early:
            try:
                self._put(content)
            except (SectionTooLarge, OSError) as error:
                self._go_on_without(Kind.BUILD, 0, error)
        self.early.clear()

    def close(self) -> None:
        """Write no more; the recording stays where it is."""
        if self.ring is not None:
            self.ring.close()
            self.ring = None
            self._put = _drop

    @property
    def has_wrapped(self) -> bool:
        """Whether the beginning of the recording has been written over."""
        return self.ring is not None and self.ring.has_wrapped

    def write(self, kind: Kind, at: int, extra: object = None) -> None:
        """Write a section of all that was recorded since the last, and clear it."""
        if kind is Kind.STEP:
            extra = self._pending.classes.note()
        fields = [kind.value, at, *self._pending.lists, extra]
        try:
            content = encode(fields)
        except Exception:  # noqa: BLE001 -- the run goes on, whatever entered it
            content = self.in_words(fields)
        self._pending.clear()
        self.put(content, kind, at)

    def in_words(self, fields: Sequence[Any]) -> bytes:
        """The section, with a value in it that cannot be written; what is lost is said."""
        try:
            return encode_in_words(fields)
        except Exception as error:  # noqa: BLE001 -- as above
            kind, at, *_ = fields
            self._schedule.hasten(at)
            return _lost(kind, at, error)

    def put(self, content: bytes, kind: Kind, at: int) -> None:
        """Put a section of this kind and instant into the ring, or say that it is missing."""
        try:
            if self._put(content):
                self._schedule.due_at = 0  # each chunk can be replayed on its own
        except (SectionTooLarge, OSError) as error:
            self._go_on_without(kind, at, error)

    def _go_on_without(self, kind: Kind, at: int, error: Exception) -> None:
        """Say that a section is missing; what follows is replayed from the next keyframe."""
        if isinstance(error, OSError):
            self._give_up(error)
        elif kind is Kind.KEYFRAME:
            self._schedule.fault = text_of(error)
        else:
            self._schedule.hasten(at)
            try:
                self._put(_lost(kind, at, error))
            except OSError as full:
                self._give_up(full)

    def _give_up(self, error: OSError) -> None:
        """Record no more; what has been written stays."""
        self.fault = f"the recording ends before the run does ({error.strerror})"
        self.close()


def _drop(_content: bytes) -> None:
    """Where sections go when nothing is recorded any more."""


def _lost(kind: int, at: int, error: Exception) -> bytes:
    """What stands in the place of a section that cannot be written."""
    why = f"{Kind(kind).name.lower()}: {text_of(error)}"
    return encode((Kind.LOST.value, at, [], [], [], [], [], [], [], why))
