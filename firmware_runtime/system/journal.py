"""Entries for systemd's journal, with fields of their own; dropped where there is no journal.

A datagram to a socket that never blocks: what does not fit is dropped and counted. Source:
systemd's native journal protocol.
"""

import os
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    import socket

SOCKET: Final = Path("/run/systemd/journal/socket")
NOTICE, WARNING = 5, 4
IDENTIFIER: Final = "firmware-runtime"


class Journal:
    """Where a service writes what happens to it."""

    def __init__(self, path: Path | None) -> None:
        self.dropped = 0
        self._socket: socket.socket | None = None
        if path is not None:
            self._socket = _connected(path)

    @classmethod
    def from_environment(cls) -> Self:
        """The journal, if systemd started this process with its output going there."""
        return cls(SOCKET if "JOURNAL_STREAM" in os.environ and SOCKET.exists() else None)

    @property
    def is_there(self) -> bool:
        """Whether there is a journal to write to."""
        return self._socket is not None

    def write(self, message: str, priority: int = NOTICE, **fields: object) -> None:
        """Write one entry; fields have names in capitals."""
        if self._socket is None:
            return
        named = {
            "MESSAGE": message,
            "PRIORITY": priority,
            "SYSLOG_IDENTIFIER": IDENTIFIER,
            **fields,
        }
        entry = b"".join(encoded(name, str(value)) for name, value in named.items())
        try:
            self._socket.send(entry)
        except OSError:
            self.dropped += 1

    def close(self) -> None:
        """Write nothing any more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _connected(path: Path) -> "socket.socket":
    import socket  # noqa: PLC0415 -- of a service only

    connected = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    connected.connect(os.fspath(path))
    return connected


def encoded(name: str, value: str) -> bytes:
    """One field: in a line, or with its length where it has several."""
    if "\n" not in value:
        return f"{name}={value}\n".encode()
    data = value.encode()
    return name.encode() + b"\n" + struct.pack("<Q", len(data)) + data + b"\n"
