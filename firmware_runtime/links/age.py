"""How long a datagram of a Unix socket has waited, by the kernel's note of when it was sent.

A run that stood still, stopped or swapped out or on a machine that slept, finds what came meanwhile
when it goes on. The kernel notes the instant by the wall clock, which goes on while a machine
sleeps; one that is set meanwhile makes a datagram younger or older.
"""

import socket
import struct
from collections.abc import Sequence
from time import time_ns
from typing import Final

from firmware_runtime.devs.time import SECOND

_SO_TIMESTAMPNS: Final = 35
_TIMESTAMP: Final = struct.Struct("@ll")  # struct timespec
BESIDE: Final = socket.CMSG_SPACE(_TIMESTAMP.size)
"""Room that `recvmsg` needs for the note."""


def note_ages(receiving: socket.socket) -> None:
    """Let the kernel note of each datagram to this socket when it was sent."""
    receiving.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)


def age_of(beside: Sequence[tuple[int, int, bytes]]) -> int:
    """How long ago a datagram was sent, ns, from what `recvmsg` gave beside it; 0 at least."""
    for _, kind, value in beside:
        if kind == _SO_TIMESTAMPNS:
            seconds, rest = _TIMESTAMP.unpack(value)
            age: int = time_ns() - (seconds * SECOND + rest)
            return max(age, 0)
    return 0
