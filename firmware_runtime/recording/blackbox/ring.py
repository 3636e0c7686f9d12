"""The ring: chunks in shared memory that a run writes sections into, without a system call.

The pages belong to the kernel, so they outlive the process, `kill -9` included; a disk has no part
in it. Its space is taken, and its pages are mapped, as it fills, some way ahead of what is written:
in small steps, in the slack of the run (`fill_ahead`). Where there was no slack, a step is taken
when it is needed.
"""

import errno
import mmap
import os
from contextlib import suppress
from pathlib import Path
from zlib import crc32

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    PREFIX_SIZE,
    SECTION,
    Size,
    prefix,
    spare_of,
)
from firmware_runtime.system.this_system import take_space

_MADV_POPULATE_WRITE = 23
STEP = 64 * 1024
"""Bytes that are taken and mapped at once: some 30 us."""
AHEAD = 4 * STEP
"""How far ahead of what is written the ring is filled."""
ALL = 1 << 62
"""In the place of a number of bytes: all of it is mapped."""
_MODE = 0o640
"""The owner writes, the group may read: as with statistics."""


class SectionTooLarge(ValueError):
    """A section that no chunk can hold."""


class Ring:
    """A new recording at `path`; `header` begins each of its chunks.

    `chunk` is the number of the one that is written, from 1. No page is written to whose space has
    not been taken: one that cannot be had then would end the run (SIGBUS). Bytes up to `end` may be
    written at once, those up to `filled` are mapped. Raises ConfigError if it cannot be made.

    A step's section is copied into it as `write` does, without that call (`steps`).
    """

    __slots__ = (
        *("begin", "chunk", "chunk_size", "end", "filled", "memory", "path", "place"),
        *("_chunk_end", "_chunks", "_descriptor", "_header", "_size"),
    )

    def __init__(self, path: Path, size: Size, header: bytes) -> None:
        self.path = path
        self.chunk = 0
        self.chunk_size = size.chunk_bytes
        self._chunks = size.chunks
        self._header = header
        if 4 * (CHUNK.size + SECTION.size + len(header)) > 3 * self.chunk_size:
            fault = f"its header of {len(header)} bytes leaves too little room in a chunk"
            expected = "expected more recording.minutes, or fewer ports and models"
            raise ConfigError.of_one(str(path), f"{fault}; {expected}")
        self.memory, self._descriptor = _mapped(path, size, header)
        self.begin = self.end = self.place = self.filled = self._chunk_end = 0
        """Of the chunk, the first byte and the one after what may be written; where the next
        section goes."""
        self._size = size.bytes
        try:
            self._open_chunk()
            self.fill_ahead(AHEAD)
        except OSError as error:
            self.close()
            raise _unmade(path, size, error) from error

    def write(self, content: bytes) -> bool:
        """Append a section; return whether it is the first of a chunk, after the header.

        Raises SectionTooLarge, and OSError where there is no room for another chunk.
        """
        begin = self.place + SECTION.size
        end = begin + len(content)
        if end > self._chunk_end:
            self._go_on_in_next_chunk(content)
            return True
        if end > self.end:
            self.fill_ahead(end - self.filled)
        SECTION.pack_into(self.memory, self.place, len(content), crc32(content))
        self.memory[begin:end] = content
        CHUNK.pack_into(self.memory, self.begin, self.chunk, end - self.begin)
        self.place = end
        return False

    def _go_on_in_next_chunk(self, content: bytes) -> None:
        least = CHUNK.size + SECTION.size + len(self._header)
        if least + SECTION.size + len(content) > self.chunk_size:
            raise SectionTooLarge(f"{len(content)} bytes are more than a chunk has room for")
        self._open_chunk()
        self.write(content)

    @property
    def is_in_last_chunk(self) -> bool:
        """Whether the next chunk is written over an older one."""
        return self.chunk >= self._chunks

    @property
    def has_wrapped(self) -> bool:
        """Whether its beginning has been written over."""
        return self.chunk > self._chunks

    def close(self) -> None:
        """Let go of the memory; the file stays, and has no room for more."""
        self.end = self._chunk_end = 0
        self.memory.close()
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def fill_ahead(self, least: int = 1) -> None:
        """Take the space of the next `STEP` bytes, or of `least`, and map their pages.

        Raises OSError where there is no room for them.
        """
        first = self.filled
        self.filled = last = min(first + max(least, STEP), self._size)
        if last > first:
            try:
                take_space(self._descriptor, first, last - first)
            except OSError:
                self.filled = first
                raise
            _populate(self.memory, first, last - first)
        if last == self._size:
            self.filled = ALL
        self.end = min(self._chunk_end, self.filled)

    def _open_chunk(self) -> None:
        """Begin the next chunk, in the place of the oldest."""
        begin = PREFIX_SIZE + self.chunk % self._chunks * self.chunk_size
        needed = begin + CHUNK.size + SECTION.size + len(self._header)
        if needed > self.filled:
            self.fill_ahead(needed - self.filled)
        CHUNK.pack_into(self.memory, begin, 0, 0)
        self.chunk += 1
        self.begin, self._chunk_end = begin, begin + self.chunk_size
        self.end = min(self._chunk_end, self.filled)
        self.place = begin + CHUNK.size
        self.write(self._header)


def _mapped(path: Path, size: Size, header: bytes) -> tuple[mmap.mmap, int]:
    """Make the file under a name of its own and map it, then give it the name people know.

    Returns its descriptor too: its space has not been taken.
    """
    unfinished = path.parent / f".{path.name}.{os.getpid()}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.unlink(missing_ok=True)
        descriptor = os.open(unfinished, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, _MODE)
        try:
            _make_room(descriptor, size.bytes)
            os.pwrite(descriptor, prefix(size.chunk_bytes, size.chunks), 0)
            spare = spare_of(size.chunk_bytes, size.chunks, size.bytes, header)
            os.pwrite(descriptor, spare, size.bytes)
            memory = mmap.mmap(descriptor, size.bytes)
            unfinished.replace(path)
            kept = os.dup(descriptor)
        finally:
            os.close(descriptor)
            unfinished.unlink(missing_ok=True)
    except OSError as error:
        raise _unmade(path, size, error) from error
    return memory, kept


def _populate(memory: mmap.mmap, begin: int, size: int) -> None:
    """Map these pages now: the first write to one that is not would be a fault, in a step."""
    first = begin - begin % mmap.PAGESIZE
    with suppress(OSError):  # of a kernel that does not know it, before Linux 5.14
        memory.madvise(_MADV_POPULATE_WRITE, first, begin + size - first)


def _unmade(path: Path, size: Size, error: OSError) -> ConfigError:
    fault = f"the recording of {size.bytes >> 20} MiB cannot be made ({error.strerror})"
    expected = "expected room for it, or recording.minutes less than it is"
    return ConfigError.of_one(str(path), f"{fault}; {expected}")


def _make_room(descriptor: int, size: int) -> None:
    """Let the file be so large without taking the space, if there is so much."""
    free = os.fstatvfs(descriptor)
    if free.f_bavail * free.f_frsize < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    os.ftruncate(descriptor, size)
