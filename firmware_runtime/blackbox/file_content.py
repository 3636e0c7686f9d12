"""The bytes of a recording's file: of a regular file, and no more of them than a recording has.

A pipe is not waited for, a device not read, and of a file that is larger than what it says of
itself the rest is left alone.
"""

import os
import stat
from io import FileIO
from pathlib import Path
from typing import Final

from firmware_runtime.blackbox.layout import PREFIX_SIZE, is_whole
from firmware_runtime.blackbox.ring_file import sizes_in
from firmware_runtime.errors import ConfigError

LARGEST: Final = 512 << 20
"""Bytes; a ring has at most 264 MiB (`blackbox.size`), a file that was saved of one twice that."""
_EXPECTED: Final = "expected a recording of a run"
_NUMBER: Final = 8
"""Bytes of a chunk's number, which stand first in it."""


def content_of(path: Path) -> bytes:
    """The prefix and the chunks it speaks of; of a file without a prefix its first bytes.

    Chunks that the run has begun to write over meanwhile are empty. Raises ConfigError.
    """
    try:
        with _opened(path) as file:
            begin = file.read(PREFIX_SIZE) or b""
            size, count = sizes_in(begin)
            most = _checked(path, file, PREFIX_SIZE + size * count)
            return _settled(begin + _read(file, most - len(begin)), size, file)
    except OSError as error:
        raise _unreadable(path, error) from error


def whole_content_of(path: Path) -> bytes:
    """All that there is, whatever it says of itself, to save what can be saved. As `content_of`."""
    try:
        with _opened(path) as file:
            said = os.pread(file.fileno(), PREFIX_SIZE, 0)
            size, count = sizes_in(said)
            length = os.fstat(file.fileno()).st_size
            stated = PREFIX_SIZE + size * (count + 1) if is_whole(said) else length  # and the spare
            return _read(file, _checked(path, file, min(stated, length)))
    except OSError as error:
        raise _unreadable(path, error) from error


def check_file(path: Path) -> None:
    """Raise ConfigError for a folder, a pipe, a device; not for what is missing or closed."""
    if os.path.exists(path) and not os.path.isfile(path):  # noqa: PTH110, PTH113 -- never raise
        raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")


def _opened(path: Path) -> FileIO:
    """The file, if it is a regular one. A device is not even opened."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise ConfigError.of_one(str(path), f"is no file; {_EXPECTED}")
    return FileIO(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "r")


def _checked(path: Path, file: FileIO, most: int) -> int:
    """How many bytes to read. Raises ConfigError for more than any recording has."""
    length = min(most, os.fstat(file.fileno()).st_size)
    if length > LARGEST:
        fault = f"is {length >> 20} MiB long; {_EXPECTED}, which has at most {LARGEST >> 20} MiB"
        raise ConfigError.of_one(str(path), fault)
    return length


def _read(file: FileIO, most: int) -> bytes:
    parts = []
    while most > 0 and (part := file.read(most)):
        parts.append(part)
        most -= len(part)
    return b"".join(parts)


def _settled(content: bytes, size: int, file: FileIO) -> bytes:
    """What was read, without the chunks that the run has begun to write over meanwhile."""
    overwritten = [
        begin
        for begin in (range(PREFIX_SIZE, len(content), size) if size else ())
        if os.pread(file.fileno(), _NUMBER, begin) != content[begin : begin + _NUMBER]
    ]
    if not overwritten:
        return content
    kept = bytearray(content)
    for begin in overwritten:
        kept[begin : begin + _NUMBER] = bytes(_NUMBER)
    return bytes(kept)


def _unreadable(path: Path, error: OSError) -> ConfigError:
    if isinstance(error, FileNotFoundError):
        return ConfigError.of_one(str(path), f"does not exist; {_EXPECTED}")
    return ConfigError.of_one(str(path), f"cannot be read ({error.strerror}); {_EXPECTED}")
