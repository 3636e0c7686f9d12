"""Which process is at the other end of a Unix socket, as the kernel says. Source: unix(7)."""

import os
import socket
import struct
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple

_UCRED: Final = struct.Struct("@iII")
_SIZE: Final = _UCRED.size
BESIDE: Final = socket.CMSG_SPACE(_SIZE)
"""Room that `recvmsg` needs for credentials."""


class Credentials(NamedTuple):
    """The numbers of a process, its user and its group."""

    process: int
    user: int
    group: int


def credentials_in(said: bytes) -> Credentials:
    """Those in a message of the kind SCM_CREDENTIALS."""
    return Credentials(*_UCRED.unpack(said))


def peer_of(connection: socket.socket) -> Credentials:
    """Those of the process at the other end. Raises OSError."""
    return credentials_in(connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _SIZE))


def may_speak(beside: Sequence[tuple[int, int, bytes]], path: Path) -> bool:
    """Whether a datagram may be from the run whose socket is at a path, by what came beside it.

    That is one of root, of this user, or of the user to whom the socket belongs.
    """
    for _, kind, said in beside:
        if kind == socket.SCM_CREDENTIALS:
            return is_trusted(credentials_in(said).user, path)
    return False


def is_trusted(user: int, path: Path) -> bool:
    """Whether a user may speak for the process whose socket is at a path."""
    if user in {0, os.geteuid()}:
        return True
    with suppress(OSError):
        return path.stat().st_uid == user
    return False
