"""Which process is at the other end of a Unix socket, as the kernel says. Source: unix(7)."""

import socket
import struct
from typing import Final, NamedTuple

_UCRED: Final = struct.Struct("@iII")
SIZE: Final = _UCRED.size
"""Bytes of credentials."""


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
    return credentials_in(connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, SIZE))
