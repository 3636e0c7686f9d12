"""The file of a recording, even while a run writes it: chunks that are whole, and its header.

It is held open, so it stays when the next run puts its own in its place. A run appends to a chunk
and then says so at its beginning; it takes the chunk's number away before it writes over it. So
bytes up to `used` are whole if the number is the same before and after they were read.

To be read it is a regular file of this user's: a pipe is not waited for, a device not opened, and
of a file that is larger than what it says of itself the rest is left alone.
"""

import math
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import msgspec
from msgspec import Struct

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    PREFIX_SIZE,
    Chunk,
    is_whole,
    sections_in,
    sizes_in,
)
from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.recording.recorded_board import RecordedBoard
from firmware_runtime.system.atomic_file import foreign_owner, refused
from firmware_runtime.system.resources import Closing

LARGEST: Final = 448 << 20
"""Bytes; a ring has at most 264 MiB (`blackbox.size`), a file that was saved of one more."""
_LARGEST_SAVED: Final = 300 << 20
"""Bytes of what is held three times as what is whole of it is saved."""
_EXPECTED: Final = "expected a recording of a run"
_NUMBER: Final = 8
"""Bytes of a chunk's number, which stand first in it."""


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
    """The file at `path`, held open until it is closed. Raises OSError.

    It has no chunks if it does not begin as a recording does.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        self.prefix = os.pread(self._descriptor, PREFIX_SIZE, 0)
        self.chunk_size, self.count = sizes_in(self.prefix)

    def close(self) -> None:
        """Let it go. Again does nothing."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    @property
    def status(self) -> os.stat_result:
        """Owner and length of the file."""
        return os.fstat(self._descriptor)

    def read(self, begin: int, size: int) -> bytes:
        """Return so many bytes from a place on, or as many as there are."""
        return os.pread(self._descriptor, size, begin)

    def chunk(self, place: int) -> bytes:
        """Return the bytes of a chunk; zeros where a run has begun to write over it meanwhile."""
        content = self.read(self.begin(place), self.chunk_size)
        if self.read(self.begin(place), _NUMBER) != content[:_NUMBER]:
            return bytes(len(content))
        return content

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
        return self.read(self.size, self.chunk_size)

    def slot(self, place: int) -> Slot:
        """What is in a chunk now; number 0: nothing, or nothing whole."""
        said = self.read(self.begin(place), CHUNK.size)
        number, used = CHUNK.unpack(said) if len(said) == CHUNK.size else (0, 0)
        return Slot(number, used) if CHUNK.size < used <= self.chunk_size else Slot(0, 0)

    def content(self, place: int, begin: int, slot: Slot) -> bytes | None:
        """Bytes of a chunk from `begin` to what was used; None if it has been written over."""
        read = self.read(self.begin(place) + begin, slot.used - begin)
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


@contextmanager
def opened(path: Path) -> Iterator[RingFile]:
    """Open a file that may be a recording. Raises ConfigError."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # before it is opened
            raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")
        with RingFile(path) as file:
            if (owner := foreign_owner(file.status)) is not None:
                raise ConfigError.of_one("recording", refused(path, owner))
            _check_length(path, min(file.size, file.status.st_size), LARGEST)
            yield file
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            fault = f"does not exist; {_EXPECTED}"
        else:
            fault = f"cannot be read ({error.strerror}); {_EXPECTED}"
        raise ConfigError.of_one(str(path), fault) from error


def whole_content_of(path: Path) -> bytes:
    """All that there is, whatever it says of itself, to save what can be saved.

    Raises ConfigError.
    """
    with opened(path) as file:
        length = file.status.st_size
        if is_whole(file.prefix):
            length = min(length, file.begin(file.count + 1))  # and the spare
        _check_length(path, length, _LARGEST_SAVED)
        return file.read(0, length)


def check_file(path: Path) -> None:
    """Raise ConfigError for a folder, a pipe, a device; not for what is missing or closed."""
    if os.path.exists(path) and not os.path.isfile(path):  # noqa: PTH110, PTH113 -- never raise
        raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")


def _check_length(path: Path, length: int, largest: int) -> None:
    """Raise ConfigError for more bytes than any recording has."""
    if length > largest:
        fault = f"is {length >> 20} MiB long; {_EXPECTED}, which has at most {largest >> 20} MiB"
        raise ConfigError.of_one(str(path), fault)
