"""Key files: the 32 secret bytes that both ends of a link or of a bridge share.

A key file holds the bytes themselves and nothing else, and only its owner may read it (mode 0600
or less). `firmware-runtime new key FILE` makes one.
"""

import os
import stat
from contextlib import suppress
from pathlib import Path
from secrets import token_bytes
from typing import Final

from firmware_runtime.errors import ConfigError

KEY_BYTES: Final = 32
_OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO


def read_key(path: Path, where: str = "key file") -> bytes:
    """The key that a file holds.

    Raises ConfigError about `where` if it cannot be read, is open to others, or is no key.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC)
    except (OSError, ValueError) as error:
        raise ConfigError.of_one(where, f"{path}: {_why(error)}", expected=_EXPECTED) from error
    try:
        mode = os.fstat(descriptor).st_mode
        key = os.read(descriptor, KEY_BYTES + 1) if stat.S_ISREG(mode) else None
    finally:
        os.close(descriptor)
    faults = _faults(mode, key)
    if key is None or faults:
        found = " and ".join(faults)
        raise ConfigError.of_one(where, f"{path}: {found}", expected=_EXPECTED)
    return key


def write_key(path: Path) -> None:
    """Make a file with a new random key, for its owner alone.

    Raises ConfigError if something is there already, or nothing can be made.
    """
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
    try:
        descriptor = os.open(path, flags, 0o600)
    except FileExistsError as error:
        raise ConfigError.of_one(
            "key file", f"{path}: there is a file already", "a new name, no key is overwritten"
        ) from error
    except (OSError, ValueError) as error:
        raise _cannot_be_made(path, error) from error
    try:
        with os.fdopen(descriptor, "wb") as file:
            os.fchmod(descriptor, 0o600)  # where the umask takes off what the owner needs
            file.write(token_bytes(KEY_BYTES))
    except OSError as error:
        with suppress(OSError):
            path.unlink()
        raise _cannot_be_made(path, error) from error


_EXPECTED: Final = (
    f"a file of {KEY_BYTES} bytes and mode 0600, such as `firmware-runtime new key FILE` makes"
)


def _faults(mode: int, key: bytes | None) -> list[str]:
    if key is None:
        return ["no regular file"]
    faults = []
    if mode & _OTHERS:
        faults.append(f"mode {stat.S_IMODE(mode):04o} opens it to others")
    if len(key) != KEY_BYTES:
        length = f"{len(key)}" if len(key) < KEY_BYTES else f"more than {KEY_BYTES}"
        faults.append(f"{length} bytes")
    elif len(set(key)) == 1:
        faults.append("all bytes are the same")
    return faults


def _cannot_be_made(path: Path, error: Exception) -> ConfigError:
    return ConfigError.of_one("key file", f"{path}: {_why(error)}", "a place that can be written")


def _why(error: Exception) -> str:
    return str(error.strerror if isinstance(error, OSError) else error)
