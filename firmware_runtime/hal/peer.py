"""Peer of a Unix socket: the process at its other end, as the kernel says. Source: unix(7)."""

import os
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from socket import socket

_UCRED: Final = struct.Struct("@iII")


class Credentials(NamedTuple):
    """The numbers of a process, its user and its group."""

    process: int
    user: int
    group: int


def peer_of(connection: "socket") -> Credentials:
    """Those of the process at the other end. Raises OSError."""
    import socket  # noqa: PLC0415 -- loaded already where there is a connection

    said = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _UCRED.size)
    return Credentials(*_UCRED.unpack(said))


def trusted_users(folder: Path) -> set[int]:
    """The users whose processes may speak for one that is reached by a path in a folder.

    Root, this process's user, and the one to whom the folder belongs, as that of a service does.
    Raises OSError.
    """
    return {0, os.geteuid(), folder.stat().st_uid}
