"""Unix sockets: one with a name in the file system, and a run's connections by it.

Of a connection the run knows who is at the other end, and how old what comes is.

A run that stood still, stopped or swapped out or on a machine that slept, finds what came meanwhile
when it goes on. The kernel notes of each message when it was sent, from when the run has taken the
connection; it goes by the wall clock, which goes on while a machine sleeps, and one that is set
meanwhile makes a message younger or older. Source: unix(7), socket(7).
"""

import errno
import os
import socket
import stat
import struct
import weakref
from contextlib import suppress
from pathlib import Path
from time import time_ns
from typing import Final, NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import OF_THE_MACHINE, ROOM_EXPECTED, ConfigError, NoRoomError
from firmware_runtime.hal.peer import Credentials, peer_of

_SO_TIMESTAMPNS: Final = 35
_TIMESTAMP: Final = struct.Struct("@ll")  # struct timespec
_BESIDE: Final = socket.CMSG_SPACE(_TIMESTAMP.size)


class Message(NamedTuple):
    """Message that has come, and how long ago it was sent, ns; 0 at least."""

    content: bytes
    age: int


class Connection:
    """The run's end of a connection to a process, `by`; nothing waits."""

    def __init__(self, accepted: socket.socket) -> None:
        self._socket = accepted
        accepted.setblocking(False)
        self.by: Credentials = peer_of(accepted)
        accepted.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)

    @property
    def may_drive(self) -> bool:
        """True if it is of root or of this process's user."""
        return self.by.user in {0, os.geteuid()}

    def fileno(self) -> int:
        """The descriptor that becomes readable when a message has come, or the process has gone."""
        return self._socket.fileno()

    def receive(self, longest: int) -> Message:
        """The next message, cut to a length; b"" once the process has gone.

        Raises BlockingIOError if there is none.
        """
        try:
            content, beside, *_ = self._socket.recvmsg(longest, _BESIDE)
        except ConnectionResetError:  # it has gone without reading all; what it said waits still
            content, beside, *_ = self._socket.recvmsg(longest, _BESIDE)
        return Message(content, _age(beside))

    def send(self, message: bytes) -> None:
        """Send without waiting. Raises BlockingIOError if there is no room, OSError otherwise."""
        self._socket.send(message)

    def close(self) -> None:
        """Send the process away; what it has not read stays there."""
        with suppress(OSError):
            self._socket.close()


def _age(beside: list[tuple[int, int, bytes]]) -> int:
    for _, kind, value in beside:
        if kind == _SO_TIMESTAMPNS:
            seconds, rest = _TIMESTAMP.unpack(value)
            age: int = time_ns() - (seconds * SECOND + rest)
            return max(age, 0)
    return 0


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
