"""Sockets that messages leave by: one for each reader, because the kernel counts by sender.

What waits unread takes room from the socket that sent it. With one socket for everybody, a reader
that never reads would in the end silence all others. So each watcher has an outlet of its own, and
an answer leaves by a socket that is closed at once. A reader must therefore not `connect` its
socket: one that is connected hears nobody but whom it is connected to.
"""

import socket

from firmware_runtime.links.watchers import Address


class Outlet:
    """Leads to the socket that has this address now; raises OSError if nobody can be told there."""

    def __init__(self, address: Address) -> None:
        self._socket = _made()
        try:
            self._socket.connect(address)
        except OSError:
            self._socket.close()
            raise

    def send(self, message: bytes) -> None:
        """Send without waiting. Raises BlockingIOError if there is no room, OSError otherwise."""
        self._socket.send(message)

    def close(self) -> None:
        """Send no more; what waits to be read stays there."""
        self._socket.close()


def send_once(message: bytes, address: Address) -> None:
    """Send without waiting, by a socket that is not kept. Raises OSError."""
    with _made() as once:
        once.sendto(message, address)


def _made() -> socket.socket:
    return socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
