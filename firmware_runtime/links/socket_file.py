"""A Unix socket that has a name in the file system, for as long as it is open."""

import errno
import os
import socket
import stat
import weakref
from contextlib import suppress
from pathlib import Path

from firmware_runtime.errors import OF_THE_MACHINE, ROOM_EXPECTED, ConfigError, NoRoomError


class SocketFile:
    """A socket that never blocks, bound to a path; its mode is as stated, less the umask.

    One that an earlier process left there is replaced, and nothing else. Raises ConfigError if it
    cannot be made, which ends with what is `expected`.
    """

    def __init__(
        self,
        path: Path,
        mode: int = 0o660,
        expected: str = "expected another place for the statistics",
        kind: socket.SocketKind = socket.SOCK_DGRAM,
    ) -> None:
        self.socket = socket.socket(socket.AF_UNIX, kind | socket.SOCK_NONBLOCK)
        try:
            os.fchmod(self.socket.fileno(), mode)  # from this mode `bind` takes the umask off
            path.parent.mkdir(parents=True, exist_ok=True)
            _remove_socket(path)
            self.socket.bind(os.fspath(path))
        except OSError as error:
            self.socket.close()
            fault = f"{path}: no socket can be made here ({error.strerror or error})"
            if error.errno in OF_THE_MACHINE:
                raise NoRoomError(f"{fault}; {ROOM_EXPECTED}") from error
            raise ConfigError(path.name, [f"{fault}; {expected}"]) from error
        self._end = weakref.finalize(self, _unbind, self.socket, path, _identity(path))

    def close(self) -> None:
        """Close the socket and remove its path, unless another has taken its place since."""
        self._end()


def _remove_socket(path: Path) -> None:
    """Remove a socket that is left there. Raises FileExistsError for anything else."""
    with suppress(FileNotFoundError):
        if not stat.S_ISSOCK(path.lstat().st_mode):
            raise FileExistsError(errno.EEXIST, "this is no socket")
        path.unlink()


def _identity(path: Path) -> tuple[int, int]:
    status = path.lstat()
    return status.st_dev, status.st_ino


def _unbind(bound: socket.socket, path: Path, identity: tuple[int, int]) -> None:
    with suppress(OSError):
        if _identity(path) == identity:
            path.unlink()
    bound.close()
