"""The bytes of a recording's file: of a regular file, and no more of them than a recording has.

A pipe is not waited for, a device not read, and of a file that is larger than what it says of
itself the rest is left alone.
"""

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from io import FileIO
from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import PREFIX_SIZE, is_whole, sizes_in
from firmware_runtime.system.atomic_file import foreign_owner, refused

LARGEST: Final = 448 << 20
"""Bytes; a ring has at most 264 MiB (`blackbox.size`), a file that was saved of one more."""
_LARGEST_SAVED: Final = 300 << 20
"""Bytes of what is held three times as what is whole of it is saved."""
_EXPECTED: Final = "expected a recording of a run"
_NUMBER: Final = 8
"""Bytes of a chunk's number, which stand first in it."""


class Content(Struct, frozen=True):
    """The bytes of a recording, read in pieces: its prefix and the chunks it speaks of."""

    length: int
    """How many there are; of a file without a prefix it has at least those."""
    read: Callable[[int, int], bytes]
    """So many bytes from a place on; a chunk that a run wrote over meanwhile is empty."""


@contextmanager
def opened_content(path: Path) -> Iterator[Content]:
    """What is in a file. Raises ConfigError."""
    try:
        with _opened(path) as file:
            descriptor = file.fileno()
            size, count = sizes_in(os.pread(descriptor, PREFIX_SIZE, 0))
            length = _checked(path, file, PREFIX_SIZE + size * count, LARGEST)
            yield Content(length, partial(_settled, descriptor))
    except OSError as error:
        raise _unreadable(path, error) from error


def whole_content_of(path: Path) -> bytes:
    """All that there is, whatever it says of itself, to save what can be saved.

    Raises ConfigError.
    """
    try:
        with _opened(path) as file:
            said = os.pread(file.fileno(), PREFIX_SIZE, 0)
            size, count = sizes_in(said)
            length = os.fstat(file.fileno()).st_size
            stated = PREFIX_SIZE + size * (count + 1) if is_whole(said) else length  # and the spare
            return os.pread(
                file.fileno(), _checked(path, file, min(stated, length), _LARGEST_SAVED), 0
            )
    except OSError as error:
        raise _unreadable(path, error) from error


def check_file(path: Path) -> None:
    """Raise ConfigError for a folder, a pipe, a device; not for what is missing or closed."""
    if os.path.exists(path) and not os.path.isfile(path):  # noqa: PTH110, PTH113 -- never raise
        raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")


def _opened(path: Path) -> FileIO:
    """The file, if it is a regular one, and no other user's. A device is not even opened."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")
    file = FileIO(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "r")
    owner = foreign_owner(os.fstat(file.fileno()))
    if owner is not None:
        file.close()
        raise ConfigError.of_one("recording", refused(path, owner))
    return file


def _checked(path: Path, file: FileIO, most: int, largest: int) -> int:
    """How many bytes to read. Raises ConfigError for more than any recording has."""
    length = min(most, os.fstat(file.fileno()).st_size)
    if length > largest:
        fault = f"is {length >> 20} MiB long; {_EXPECTED}, which has at most {largest >> 20} MiB"
        raise ConfigError.of_one(str(path), fault)
    return length


def _settled(descriptor: int, begin: int, size: int) -> bytes:
    """What was read; zeros where a run has begun to write over it meanwhile."""
    content = os.pread(descriptor, size, begin)
    if os.pread(descriptor, _NUMBER, begin) != content[:_NUMBER]:
        return bytes(len(content))
    return content


def _unreadable(path: Path, error: OSError) -> ConfigError:
    if isinstance(error, FileNotFoundError):
        return ConfigError.of_one(str(path), f"does not exist; {_EXPECTED}")
    return ConfigError.of_one(str(path), f"cannot be read ({error.strerror}); {_EXPECTED}")
