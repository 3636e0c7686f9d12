"""A ring that a run is writing, read by another process: chunks that are whole, and when.

It is held open, so it stays when the next run puts its own in its place. A run appends to a chunk
and then says so at its beginning; it takes the chunk's number away before it writes over it. So
bytes up to `used` are whole if the number is the same before and after they were read.

Its header names the robot, the settings, the code and the machine.
"""

import errno
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    PREFIX_SIZE,
    Chunk,
    sections_in,
    sizes_in,
)
from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.recording.recorded_board import RecordedBoard
from firmware_runtime.system.resources import Closing


class Header(RecordedBoard, frozen=True, kw_only=True):
    """The first section of every chunk; the name is with its role where it is one end of two."""

    run: str
    """A name of the run that no other has."""
    began: tuple[int, int] | None = None
    """CLOCK_MONOTONIC and the system's time as the recording began, ns."""
    role: str | None
    """The role that the process played; None for the whole robot."""
    has_world: bool
    """Whether its doubles were in the same process, and their world's models in the model."""
    speed: float
    lines: list[str]
    """Names of buses and ports, in order of their numbers."""
    early: list[str]
    """Those of the buses that answer before a transaction has ended on the wire."""
    ports: list[str]
    """Output ports by path below the root, in order of their numbers."""
    world: list[str]
    """Paths of the atomics that are not the robot's own."""
    chance: Any = None
    """Where the process's generators of random numbers stood before the robot was built."""


def header_in(content: bytes) -> Header | None:
    """The header that a section is; None for what is none."""
    try:
        section = decode(content)
        header = msgspec.convert(section.extra, Header)
    except msgspec.MsgspecError:
        return None
    is_one = section.kind is Kind.HEADER and 0 <= header.speed < math.inf
    return header if is_one else None


class Slot(Struct, frozen=True):
    """What the beginning of a chunk says: its number, and how many of its bytes are used."""

    number: int
    used: int


class RingFile(Closing):
    """The ring at `path`, held open until it is closed. Raises OSError, also for what is none."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        self.prefix = os.pread(self._descriptor, PREFIX_SIZE, 0)
        self.chunk_size, self.count = sizes_in(self.prefix)
        if self.chunk_size == 0:
            self.close()
            raise OSError(errno.EINVAL, "no recording of a run", str(path))

    def close(self) -> None:
        """Let it go. Again does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    @property
    def size(self) -> int:
        """Bytes of all of it, but for the spare."""
        return self.begin(self.count)

    def begin(self, place: int) -> int:
        """Where a chunk begins."""
        return PREFIX_SIZE + place * self.chunk_size

    @property
    def spare(self) -> bytes:
        """The second copy of prefix and header, behind the last chunk."""
        return os.pread(self._descriptor, self.chunk_size, self.size)

    def slot(self, place: int) -> Slot:
        """What is in a chunk now; number 0: nothing, or nothing whole."""
        said = os.pread(self._descriptor, CHUNK.size, self.begin(place))
        number, used = CHUNK.unpack(said) if len(said) == CHUNK.size else (0, 0)
        return Slot(number, used) if CHUNK.size < used <= self.chunk_size else Slot(0, 0)

    def content(self, place: int, begin: int, slot: Slot) -> bytes | None:
        """Bytes of a chunk from `begin` to what was used; None if it has been written over."""
        read = os.pread(self._descriptor, slot.used - begin, self.begin(place) + begin)
        is_whole = len(read) == slot.used - begin and self.slot(place).number == slot.number
        return read if is_whole else None

    def chunks(self) -> list[Chunk]:
        """Return what is in it, in order of its numbers; sections are not looked into."""
        return sorted(self._whole(), key=lambda chunk: chunk.number)

    def header(self) -> Header | None:
        """What the recording says of itself; None if it does not."""
        chunk = next(self._whole(), None)
        return None if chunk is None else header_in(next(iter(chunk.contents), b""))

    def _whole(self) -> Iterator[Chunk]:
        for place in range(self.count):
            slot = self.slot(place)
            if slot.number > 0 and (content := self.content(place, 0, slot)) is not None:
                sections = sections_in(content, len(content))
                yield Chunk(slot.number, [section for section, _ in sections])
