"""Small files that are replaced at once: a reader finds the new one whole, or the one before.

Files are read of oneself, of root and of the service only: anybody may put a file or a folder where
it is looked for, such as among temporary files, and what a run leaves says which code to load and
what to feed it.
"""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from firmware_runtime.errors import ConfigError

OWN_AND_GROUP: Final = 0o640
"""The owner writes, the group may read: a robot's operators need not be root."""
MOST: Final = 1 << 24
"""Bytes that are read at most."""


def replace_file(
    path: Path, content: bytes, mode: int | None = None, *, synced: bool = False
) -> None:
    """Put content there, with these permissions if any are stated. Raises OSError.

    With `synced` it is waited until the disk has it, and power loss leaves either.

    """
    with unfinished_file(path, mode) as descriptor, os.fdopen(os.dup(descriptor), "wb") as file:
        file.write(content)
        if synced:
            file.flush()
            os.fsync(descriptor)
    if synced:
        sync_folder(path.parent)


@contextmanager
def unfinished_file(path: Path, mode: int | None = None) -> Iterator[int]:
    """Yield the descriptor of a new file, which gets its name when the block ends well.

    It is made under a name that nothing had before, so nothing is followed or written through that
    another user put there. What could not be finished is removed. Raises OSError.
    """
    unfinished = path.parent / f".{path.name}.{os.getpid()}"
    unfinished.unlink(missing_ok=True)
    flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
    descriptor = os.open(unfinished, flags, 0o666 if mode is None else mode)
    try:
        if mode is not None:
            os.fchmod(descriptor, mode)
        yield descriptor
        unfinished.replace(path)
    finally:
        os.close(descriptor)
        unfinished.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Wait until the disk has what a folder's files are called. Raises OSError."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def keep_file(path: Path, content: bytes, mode: int | None = None) -> None:
    """Like `replace_file`, at a place that a user named. Raises OSError.

    A device, FIFO or socket there is left as it is: /dev/full or /dev/stdout would be gone for all.
    """
    place = Path(os.path.realpath(path))
    demand_regular(place)
    replace_file(place, content, mode)


def demand_regular(path: Path) -> None:
    """Raise OSError if something that is no regular file stands there."""
    if os.path.exists(path) and not os.path.isfile(path):  # noqa: PTH110, PTH113 -- never raise
        raise OSError(errno.EINVAL, "no regular file", str(path))


def keep_output(output: Path, content: bytes, option: str = "-o", mode: int | None = None) -> None:
    """Like `keep_file`, at what an option names. Raises ConfigError."""
    try:
        keep_file(output, content, mode)
    except OSError as error:
        fault = f"{output}: {error.strerror}; expected a file that can be written"
        raise ConfigError.of_one(option, fault) from error


def read_file(path: Path) -> bytes:
    """Return what a file holds; a FIFO in its place is not waited for.

    Raises OSError, also for what is no regular file, or larger than such a file can be.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode) or status.st_size > MOST:
            raise OSError(errno.EINVAL, "no regular file of a sensible size", str(path))
        return file.read(status.st_size)


def read_content(path: Path) -> bytes:
    """The bytes of a file that a user names. Raises ConfigError; a FIFO is not waited for."""
    try:
        return read_file(path)
    except OSError as error:
        raise ConfigError.of_one(str(path), f"cannot be read: {error.strerror}") from error


def read_text(path: Path) -> str:
    """The text of a file that a user names. Raises ConfigError; a FIFO is not waited for."""
    try:
        return read_content(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError.of_one(str(path), "cannot be read: not UTF-8", expected="text") from error


def why_not_writable(path: Path) -> str | None:
    """Return why no file can be opened there to be written, in words.

    None if it seems to be possible.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return _why_not_made(Path(os.path.realpath(path)).parent)
    except OSError as error:
        return error.strerror or type(error).__name__
    except ValueError:
        return "a null character in its name"
    if stat.S_ISDIR(mode):
        return "it is a folder"
    return None if os.access(path, os.W_OK) else "no right to write it"


def _why_not_made(folder: Path) -> str | None:
    """Return why no file can be made in a folder."""
    if not folder.exists():
        return f"there is no folder {folder}"
    if not folder.is_dir():
        return f"{folder} is no folder"
    return None if os.access(folder, os.W_OK | os.X_OK) else f"no right to write into {folder}"


SERVICE_USER: Final = "firmware-runtime"


def foreign_owner(status: os.stat_result) -> str | None:
    """Name of the user who owns it; None for oneself, root, and the user of the service."""
    if status.st_uid in (0, os.geteuid()):
        return None
    from pwd import getpwuid  # noqa: PLC0415 -- seldom comes to this

    try:
        name = getpwuid(status.st_uid).pw_name
    except KeyError:
        return f"user {status.st_uid}"
    return None if name == SERVICE_USER else name


def owner_of_folder(folder: Path) -> str | None:
    """As `foreign_owner`, of a folder, or of that which it would be made in."""
    for each in (folder, folder.parent):
        try:
            return foreign_owner(each.stat())
        except OSError:
            continue
    return None


def refused(path: Path, owner: str) -> str:
    """Return why a file or folder is not read, and how one gets it all the same."""
    expected = "expected one's own, root's or the service's; a copy of one's own can be read"
    return f"{path} belongs to {owner}; {expected}"
