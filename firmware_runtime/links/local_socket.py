"""A connection of a run's Unix socket: who is at the other end, and how old what comes is.

A run that stood still, stopped or swapped out or on a machine that slept, finds what came meanwhile
when it goes on. The kernel notes of each message when it was sent, from when the run has taken the
connection; it goes by the wall clock, which goes on while a machine sleeps, and one that is set
meanwhile makes a message younger or older. Source: unix(7), socket(7).
"""

import os
import socket
import struct
from contextlib import suppress
from time import time_ns
from typing import Final, NamedTuple

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.peer import Credentials, peer_of

_SO_TIMESTAMPNS: Final = 35
_TIMESTAMP: Final = struct.Struct("@ll")  # struct timespec
_BESIDE: Final = socket.CMSG_SPACE(_TIMESTAMP.size)


class Message(NamedTuple):
    """What has come, and how long ago it was sent, ns; 0 at least."""

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
        """Whether it is of root or of this process's user; the others' reading takes less."""
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
