"""Who watches which output ports, until when, and the sockets by which messages go to them.

One socket for each reader, because the kernel counts by sender: what waits unread takes room from
the socket that sent it. With one socket for all, a reader that never reads would in the end silence
the others. So each watcher has an outlet of its own, and an answer leaves by a socket that is
closed at once. A reader must therefore not `connect` its socket: one that is connected receives
from no other than the one it is connected to.
"""

import socket
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final, Protocol, TypeAlias

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.links.ports.datagrams import Refusal

Address: TypeAlias = str | bytes
"""Of a Unix socket: a path, or bytes that begin with a zero."""

MOST: Final = 16
"""How many may watch at a time."""
WATCHED_FOR: Final = 10 * SECOND
"""How long messages go to a watcher that does not ask again, ns."""


class Outlet(Protocol):
    """The way to one watcher."""

    def send(self, message: bytes) -> None:
        """Send without waiting. Raises OSError."""

    def close(self) -> None:
        """Send no more."""


@dataclass(slots=True)
class Watcher:
    """One reader; `seen` counts the messages of each port it watches."""

    address: Address
    outlet: Outlet
    every: int = 1
    until: int = NEVER
    seen: dict[str, int] = field(default_factory=dict)

    def wants(self, port: str) -> bool:
        """Whether this message is one to be sent; the first is."""
        if port not in self.seen:
            return False
        self.seen[port] += 1
        return self.seen[port] % self.every == 1 % self.every


class Watchers:
    """All of them, by address; `now` is any clock in ns that does not stand still.

    `lead_to` makes the way to an address; it raises OSError if there is none.
    """

    def __init__(self, now: Callable[[], int], lead_to: Callable[[Address], Outlet]) -> None:
        self._now = now
        self._lead_to = lead_to
        self._all: dict[Address, Watcher] = {}
        self._first_ends_at = NEVER

    def __len__(self) -> int:
        return len(self._all)

    @property
    def ports(self) -> tuple[str, ...]:
        """What is watched at all, each once."""
        return tuple(dict.fromkeys(port for each in self._all.values() for port in each.seen))

    def renew(self, address: Address, ports: Iterable[str], every: int) -> None:
        """Add a watcher, or note what it watches now. Raises Refusal if that cannot be."""
        watched = tuple(ports)
        if not watched:
            self.forget(address)
            return
        watcher = self._all.get(address) or self._new(address)
        seen = watcher.seen if watcher.every == every else {}
        watcher.seen = {port: seen.get(port, 0) for port in watched}
        watcher.every, watcher.until = every, self._now() + WATCHED_FOR
        self._find_first_end()

    def forget(self, address: Address) -> None:
        """Close its outlet."""
        watcher = self._all.pop(address, None)
        if watcher is not None:
            watcher.outlet.close()
            self._find_first_end()

    def forget_silent(self) -> bool:
        """Forget those who have not asked again; return whether there may have been any."""
        now = self._now()
        if now < self._first_ends_at:
            return False
        for watcher in [each for each in self._all.values() if each.until <= now]:
            self.forget(watcher.address)
        return True

    def of(self, port: str) -> list[Watcher]:
        """Who is to get the message that has just left a port; counts it."""
        return [each for each in self._all.values() if each.wants(port)]

    def close(self) -> None:
        """Forget all."""
        for address in list(self._all):
            self.forget(address)

    def _new(self, address: Address) -> Watcher:
        if len(self._all) >= MOST:
            raise Refusal(f"{MOST} others watch already; expected some to stop or to fall silent")
        try:
            watcher = self._all[address] = Watcher(address, self._lead_to(address))
        except OSError as error:
            fault = f"no way back to the sender ({error.strerror})"
            raise Refusal(f"{fault}; expected a socket that is not connected") from error
        return watcher

    def _find_first_end(self) -> None:
        self._first_ends_at = min((each.until for each in self._all.values()), default=NEVER)


class SocketOutlet:
    """Leads to the socket that has this address now; raises OSError if there is none."""

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
