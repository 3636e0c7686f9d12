"""Who watches which output ports, and until when.

Each has a connection of its own, because the kernel counts by sender: what waits unread takes room
from the socket that sent it. With one socket for all, a reader that never reads would in the end
silence the others.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final, Protocol

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.links.ports.datagrams import Refusal

MOST: Final = 16
"""How many may watch at a time."""
WATCHED_FOR: Final = 10 * SECOND
"""How long messages go to a watcher that does not ask again, ns."""


class Outlet(Protocol):
    """The way to one watcher."""

    def send(self, message: bytes) -> None:
        """Send without waiting. Raises OSError."""


@dataclass(slots=True)
class Watcher:
    """One reader; `seen` counts the messages of each port it watches."""

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
    """All of them, by outlet; `now` is any clock in ns that does not stand still."""

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self._all: dict[Outlet, Watcher] = {}
        self._first_ends_at = NEVER

    def __len__(self) -> int:
        return len(self._all)

    @property
    def ports(self) -> tuple[str, ...]:
        """What is watched at all, each once."""
        return tuple(dict.fromkeys(port for each in self._all.values() for port in each.seen))

    def renew(self, outlet: Outlet, ports: Iterable[str], every: int) -> None:
        """Add a watcher, or note what it watches now. Raises Refusal if there are too many."""
        watched = tuple(ports)
        if not watched:
            self.forget(outlet)
            return
        watcher = self._all.get(outlet) or self._new(outlet)
        seen = watcher.seen if watcher.every == every else {}
        watcher.seen = {port: seen.get(port, 0) for port in watched}
        watcher.every, watcher.until = every, self._now() + WATCHED_FOR
        self._find_first_end()

    def forget(self, outlet: Outlet) -> None:
        """Send it no more."""
        if self._all.pop(outlet, None) is not None:
            self._find_first_end()

    def forget_silent(self) -> bool:
        """Forget those who have not asked again; return whether there may have been any."""
        now = self._now()
        if now < self._first_ends_at:
            return False
        for watcher in [each for each in self._all.values() if each.until <= now]:
            self.forget(watcher.outlet)
        return True

    def of(self, port: str) -> list[Watcher]:
        """Who is to get the message that has just left a port; counts it."""
        return [each for each in self._all.values() if each.wants(port)]

    def _new(self, outlet: Outlet) -> Watcher:
        if len(self._all) >= MOST:
            raise Refusal(f"{MOST} others watch already", expected="some to stop or to fall silent")
        watcher = self._all[outlet] = Watcher(outlet)
        return watcher

    def _find_first_end(self) -> None:
        self._first_ends_at = min((each.until for each in self._all.values()), default=NEVER)
