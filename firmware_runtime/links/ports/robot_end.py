"""The other end of the ports socket: how a process of its own speaks with a running robot."""

import os
import socket
import struct
from collections.abc import Iterator
from contextlib import suppress
from errno import ECONNREFUSED
from pathlib import Path
from typing import Final

from firmware_runtime.hal.errors import HalError
from firmware_runtime.system import credentials

AT_ONCE: Final = 64
"""How many datagrams are taken in a row."""
_LONGEST: Final = 1 << 18


class NoAnswer(HalError, TimeoutError):
    """Nothing that can be believed was answered in time."""


class RobotEnd:
    """A socket that speaks with whatever run listens at a path: with this one, and the next.

    `timeout_s` is how long it waits for room to say something in, 0 for not at all. Raises OSError
    if there is no descriptor left for it.
    """

    def __init__(self, path: Path, timeout_s: float = 0.0) -> None:
        self._path = os.fspath(path)
        self._socket = _made()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_PASSCRED, 1)
        self._socket.bind("")  # the kernel finds a name for the answers, in no directory
        if timeout_s > 0:
            self._socket.setblocking(True)
            whole, part = divmod(round(timeout_s * 1e6), 10**6)
            timeout = struct.pack("@ll", whole, part)
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeout)

    def fileno(self) -> int:
        """The descriptor that becomes readable when the robot has said something."""
        return self._socket.fileno()

    def send(self, datagram: bytes) -> None:
        """Say something, without waiting longer than its timeout.

        Raises BlockingIOError if there is no room for it, another OSError if no run listens.
        """
        self._socket.sendto(datagram, self._path)

    def received(self) -> Iterator[bytes]:
        """What the robot has said, without waiting.

        Every program of this computer may send to a socket that has its name in no directory: what
        one sends that might not write to the run's socket either is dropped.
        """
        with suppress(BlockingIOError):
            for _ in range(AT_ONCE):
                said, beside, *_ = self._socket.recvmsg(
                    _LONGEST, credentials.BESIDE, socket.MSG_DONTWAIT
                )
                if credentials.may_speak(beside, Path(self._path)):
                    yield said

    def forget(self) -> None:
        """Nothing is to be forgotten: whatever run listens is the right one."""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class OneRunsEnd(RobotEnd):
    """The same with one run: the first that it says something to, and none that comes after it.

    It knows that run by its socket's file, and is not connected: a run answers from another socket.
    """

    _listens: tuple[int, ...] | None = None

    def send(self, datagram: bytes) -> None:
        """Say something to that run; what `RobotEnd` raises, also once another listens there."""
        found = Path(self._path).stat()
        listens = found.st_dev, found.st_ino, found.st_ctime_ns
        if self._listens not in (None, listens):
            raise ConnectionRefusedError(ECONNREFUSED, "another run listens there")
        super().send(datagram)
        self._listens = listens


def why_absent(path: Path) -> str:
    """Why there is no run to speak with at a path, empty if there is one; it does not notice."""
    with _made() as probe:
        try:
            probe.connect(os.fspath(path))
        except OSError as error:
            return error.strerror or str(error)
    return ""


def _made() -> socket.socket:
    return socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
