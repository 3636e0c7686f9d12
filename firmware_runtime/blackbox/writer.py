"""The writer: makes a section of what was heard, and puts it into the ring.

It makes no system call and waits for nothing, and whatever entered a run, the run goes on: a value
that cannot be written is written in words, a section that cannot be is said to be missing, and
where there is no room for more the recording ends.
"""

from collections.abc import Callable

from firmware_runtime.blackbox.heard import Heard
from firmware_runtime.blackbox.keyframe_schedule import KeyframeSchedule
from firmware_runtime.blackbox.ring import Ring, SectionTooLarge
from firmware_runtime.blackbox.section import Kind, encode, encode_in_words
from firmware_runtime.errors import text_of
from firmware_runtime.recording.values import legible


class Writer:
    """Writes what is `heard`; before there is a ring, into a list.

    `fault` says why something is missing.
    """

    def __init__(self, heard: Heard, schedule: KeyframeSchedule) -> None:
        self.early: list[bytes] = []
        """Sections from before there was a ring."""
        self.fault: str | None = None
        self._heard = heard
        self._schedule = schedule
        self._ring: Ring | None = None
        self._put: Callable[[bytes], bool | None] = self.early.append
        """Where sections go; returns whether this one is the first of a chunk."""

    def open(self, make_ring: Callable[[], Ring | None]) -> None:
        """Make the ring, and write what was heard before; without one write nothing more."""
        ring = self._ring = make_ring()
        self._put = _drop if ring is None else ring.write
        for content in self.early:
            try:
                self._put(content)
            except (SectionTooLarge, OSError) as error:
                self._go_on_without(Kind.BUILD, 0, error)
        self.early.clear()

    def close(self) -> None:
        """Write no more; the recording stays where it is."""
        if self._ring is not None:
            self._ring.close()
            self._ring = None
            self._put = _drop

    @property
    def has_ring(self) -> bool:
        """Whether it writes into shared memory."""
        return self._ring is not None

    @property
    def has_wrapped(self) -> bool:
        """Whether the beginning of the recording has been written over."""
        return self._ring is not None and self._ring.has_wrapped

    def write(self, kind: Kind, at: int, extra: object = None) -> None:
        """Write a section of all that was heard since the last, and forget it."""
        fields = self._heard.fields
        of_step = fields[0], fields[-1]
        fields[0], fields[-1] = kind.value, extra
        try:
            self.write_step(at)
        finally:
            fields[0], fields[-1] = of_step

    def write_step(self, at: int) -> None:
        """Write all that was heard in the step of that instant, and forget it."""
        # when little of it is in the processor's caches: straight on, and functions as locals,
        # which CPython calls sooner
        heard, put = self._heard, self._put
        fields = heard.fields
        fields[1] = at
        try:
            content = encode(fields)
        except Exception:  # noqa: BLE001 -- the run goes on, whatever entered it
            content = self._in_words(at)
        heard.clear()
        try:
            if put(content):
                self._schedule.due_at = 0  # each chunk can be replayed on its own
        except (SectionTooLarge, OSError) as error:
            self._go_on_without(fields[0], at, error)

    def _in_words(self, at: int) -> bytes:
        """A section with a value in it that cannot be written; what is lost is said."""
        fields = self._heard.fields
        try:
            return encode_in_words(fields)
        except Exception as error:  # noqa: BLE001 -- as above
            self._schedule.hasten(at)
            return _lost(fields[0], at, error)

    def _go_on_without(self, kind: int, at: int, error: Exception) -> None:
        """Say that a section is missing; what follows is replayed from the next keyframe."""
        if isinstance(error, OSError):
            self._give_up(error)
        elif kind == Kind.KEYFRAME:
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
    why = legible(f"{Kind(kind).name.lower()}: {text_of(error)}")
    return encode((Kind.LOST.value, at, [], [], [], [], [], [], [], why))
