"""Files of integers in shared memory: written without a system call, read by any process.

How it works. The file is

    magic (8 bytes) | schema | length of the file | length of the header, each 64 bits
    header: JSON, padded to a multiple of 8
    cells: signed 64-bit integers

and is mapped once, before the run. After that a number is a store to memory. There is no lock, so a
reader can neither delay nor stop the writer, and the pages belong to the kernel, so they outlive
the process, kill -9 included.

The file appears under its name complete, by renaming. Its space is allocated at once, so that a
full disk refuses the run instead of killing it later. Other readers and writers use `pread` and
`pwrite`, never a mapping: a file that is cut short meanwhile cannot kill them.
"""

import mmap
import os
import stat
import struct
import weakref
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec
from msgspec import Struct

from firmware_runtime.errors import (
    OF_THE_MACHINE,
    ROOM_EXPECTED,
    NoRoomError,
    StatisticsFileError,
    in_words,
)
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.system.atomic_file import (
    OWN_AND_GROUP,
    demand_regular,
    foreign_owner,
    refused,
    unfinished_file,
)
from firmware_runtime.system.this_system import take_space

T = TypeVar("T", bound=msgspec.Struct)
PREFIX = struct.Struct("=8s3q")
CELL = struct.Struct("=q")
_LONGEST_HEADER = 1 << 24
"""Bytes; a header that says it is longer is damaged, and must not fill the reader's memory."""


class Kind(Struct, frozen=True):
    """Kind of file: its name in sentences, and the bytes that it starts with."""

    name: str
    magic: bytes
    schema: int

    def encode(self, header: Mapping[str, object], cells: int) -> bytes:
        """Everything before the cells, which it leaves aligned."""
        from json import dumps  # noqa: PLC0415 -- a start that makes no file needs none of it

        text = dumps(header, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 8)
        size = PREFIX.size + len(text) + 8 * cells
        return PREFIX.pack(self.magic, self.schema, size, len(text)) + text

    def create(self, path: Path | None, header: Mapping[str, object], cells: int) -> Cells:
        """Map a new file, with all cells zero; without a path the memory is anonymous.

        Raises StatisticsFileError when the file cannot be made.
        """
        start = b"" if path is None else self.encode(header, cells)  # which a file alone has
        size = len(start) + 8 * cells
        try:
            memory = mmap.mmap(-1, size) if path is None else _publish(path, size, start)
        except OSError as error:
            fault = f"{path}: the {self.name} cannot be made ({error.strerror})"
            if error.errno in OF_THE_MACHINE:
                raise NoRoomError(f"{fault}; {ROOM_EXPECTED}") from error
            raise StatisticsFileError(
                fault, expected="a directory that this user may write"
            ) from error
        return memoryview(memory)[len(start) :].cast("q")

    @contextmanager
    def opened(self, path: Path, mode: int = os.O_RDONLY) -> Iterator["ReadableFile"]:
        """Open a file, its prefix and header checked; a FIFO in its place is not waited for.

        Raises StatisticsFileError when there is none, when it is cut short, or when it is not of
        this kind and schema.
        """
        try:
            descriptor = os.open(path, mode | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
        except OSError as error:
            action = "read" if mode == os.O_RDONLY else "written"
            fault = f"{path}: the {self.name} cannot be {action} ({error.strerror})"
            is_closed = isinstance(error, PermissionError)
            expected = "the user of that run, or root" if is_closed else "a run to have written it"
            raise StatisticsFileError(fault, expected=expected) from error
        try:
            yield ReadableFile(self, path, descriptor)
        except OSError as error:  # a directory, a disk that fails
            fault = f"{path}: {error.strerror}"
            raise StatisticsFileError(fault, expected=f"a {self.name}") from error
        finally:
            os.close(descriptor)


class ReadableFile:
    """An open file: its `header`, and copies of its cells."""

    def __init__(self, kind: Kind, path: Path, descriptor: int) -> None:
        self.path = path
        self._kind = kind
        self._descriptor = descriptor
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise self.damaged("it is no regular file")
        if (owner := foreign_owner(status)) is not None:
            raise StatisticsFileError(refused(path, owner))
        self._size, header_size = self._read_prefix()
        if status.st_size != self._size:
            raise self.damaged(f"{status.st_size} bytes, expected {self._size}")
        self._first = PREFIX.size + header_size
        if not PREFIX.size <= self._first <= min(self._size, _LONGEST_HEADER):
            raise self.damaged(f"a header of {header_size} bytes in a file of {self._size}")
        self.header: dict[str, object] = self._read_header(header_size)

    def _read_prefix(self) -> tuple[int, int]:
        """Return how many bytes the file has, and how many of them its header."""
        kind, prefix = self._kind, os.pread(self._descriptor, PREFIX.size, 0)
        if prefix[: len(kind.magic)] != kind.magic:
            raise self.damaged(f"it starts with {prefix[:8]!r}, expected {kind.magic!r}")
        if len(prefix) < PREFIX.size:
            raise self.damaged(f"{len(prefix)} bytes, expected at least {PREFIX.size}")
        schema: int
        size: int
        header_size: int
        _, schema, size, header_size = PREFIX.unpack(prefix)
        if schema != kind.schema:
            raise StatisticsFileError(
                f"schema {schema}; this program reads schema {kind.schema}", where=self.path
            )
        return size, header_size

    @property
    def cell_bytes(self) -> int:
        """Number of bytes of cells there are."""
        return self._size - self._first

    def read(self, first: int = 0, size: int | None = None) -> bytes:
        """Copy cells, given in bytes; all of them by default."""
        wanted = self.cell_bytes if size is None else size
        cells = os.pread(self._descriptor, wanted, self._first + first)
        if len(cells) != wanted:
            raise self.damaged(f"cut to {self._first + first + len(cells)} bytes while read")
        return cells

    def duplicate(self) -> int:
        """A second descriptor of this very file, whatever lies at its path by now."""
        return os.dup(self._descriptor)

    def place(self, index: int) -> int:
        """Return where in the file a cell stands."""
        return self._first + index * CELL.size

    def damaged(self, fault: str) -> StatisticsFileError:
        """An error that says what is wrong with this file."""
        return StatisticsFileError(f"not a whole {self._kind.name}: {fault}", where=self.path)

    def header_as(self, kind: type[T]) -> T:
        """The header, typed. Raises StatisticsFileError that says which part is of no use."""
        try:
            return msgspec.convert(self.header, kind)
        except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
            raise self.damaged(f"its header has no usable {in_words(error)}") from error

    def _read_header(self, size: int) -> dict[str, object]:
        from json import loads  # noqa: PLC0415 -- as above

        try:
            header = loads(os.pread(self._descriptor, size, PREFIX.size))
        except (ValueError, RecursionError) as error:
            raise self.damaged(f"its header is not JSON ({error})") from error
        if not isinstance(header, dict):
            raise self.damaged(f"its header is a {type(header).__name__}, expected an object")
        return header


class SharedCells:
    """Single cells of a file that another process has mapped, read and written in the file itself.

    Both raise StatisticsFileError for a file that was cut short, or that the disk refuses.
    """

    def __init__(self, file: ReadableFile) -> None:
        self._file = file
        self._descriptor = file.duplicate()
        weakref.finalize(self, os.close, self._descriptor)

    def __getitem__(self, index: int) -> int:
        """Read a cell."""
        try:
            found = os.pread(self._descriptor, CELL.size, self._file.place(index))
        except OSError as error:
            raise self._file.damaged(f"cell {index} cannot be read ({error.strerror})") from error
        if len(found) < CELL.size:
            raise self._file.damaged(f"cut short before cell {index}")
        value: int = CELL.unpack(found)[0]
        return value

    def __setitem__(self, index: int, value: int) -> None:
        """Let a cell hold a value."""
        self[index]  # of a file that was cut short: writing would only make it longer
        try:
            os.pwrite(self._descriptor, CELL.pack(value), self._file.place(index))
        except OSError as error:
            raise self._file.damaged(f"cell {index} not written ({error.strerror})") from error


def _publish(path: Path, size: int, start: bytes) -> mmap.mmap:
    """Make the file under a name of its own, fill and map it, then give it the name people know."""
    demand_regular(path)  # a device or a pipe, such as /dev/full, would be gone for all
    path.parent.mkdir(parents=True, exist_ok=True)
    with unfinished_file(path, OWN_AND_GROUP) as descriptor:
        take_space(descriptor, 0, size)
        os.pwrite(descriptor, start, 0)
        return mmap.mmap(descriptor, size)
