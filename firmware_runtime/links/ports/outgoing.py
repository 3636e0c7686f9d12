"""Outgoing messages of a run's socket: answers, and what the ports that are watched send.

Nothing is sent but when the loop has time, except the answer to a request; nothing waits for a
reader: what finds no room, here or in its connection, is dropped and counted.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, TypeAlias

from msgspec import Struct

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import Listening, OutPort
from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.local_socket import Connection
from firmware_runtime.links.ports.datagrams import Refusal, Watch, message_of
from firmware_runtime.links.ports.ports import Ports

Sent: TypeAlias = tuple[str, int, object]
"""The port's path, the instant in ns, the value."""

ROOM: Final = 256
"""How many messages may wait to be sent on; then the oldest makes room."""


class Taps:
    """Output ports that are listened to while they are watched; one that is not costs nothing.

    What was sent waits in `sent`, oldest first; `lost` counts what found no room.
    """

    def __init__(self, simulator: Engine) -> None:
        self.sent: deque[Sent] = deque(maxlen=ROOM)
        self.lost = 0
        self._simulator = simulator
        self._ports: Mapping[str, OutPort[Any]] = {}
        self._listening: list[Listening] = []

    def open(self, ports: Mapping[str, OutPort[Any]]) -> None:
        """Listen to these ports from now on, by path, and to no others."""
        if ports == self._ports:
            return
        self._ports = ports
        for listening in self._listening:
            listening.end()
        self._listening = [self._listen(path, port) for path, port in ports.items()]

    def _listen(self, path: str, port: OutPort[Any]) -> Listening:
        sent = self.sent

        def take(at: int, value: object) -> None:
            if len(sent) == ROOM:
                self.lost += 1
            sent.append((path, at, value))

        return self._simulator.listen(port, take)


MOST: Final = 16
"""How many may watch at a time."""
WATCHED_FOR: Final = 10 * SECOND
"""How long messages go to a watcher that does not ask again, ns."""


class Watcher(Struct):
    """One reader; `seen` counts the messages of each port it watches."""

    outlet: Connection
    every: int = 1
    until: int = NEVER
    seen: dict[str, int] = {}

    def wants(self, port: str) -> bool:
        """Return whether this message is one to be sent; the first is."""
        if port not in self.seen:
            return False
        self.seen[port] += 1
        return self.seen[port] % self.every == 1 % self.every


class Watchers:
    """Watchers by outlet; `now` is any clock in ns that does not stand still.

    Each has a connection of its own, because the kernel counts by sender: what waits unread takes
    room from the socket that sent it. With one socket for all, a reader that never reads would in
    the end silence the others.
    """

    def __init__(self, now: Callable[[], int]) -> None:
        self._now = now
        self._all: dict[Connection, Watcher] = {}
        self._first_ends_at = NEVER

    @property
    def ports(self) -> tuple[str, ...]:
        """Paths of all ports that are watched, each once."""
        return tuple(dict.fromkeys(port for each in self._all.values() for port in each.seen))

    def renew(self, outlet: Connection, ports: Iterable[str], every: int) -> None:
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

    def forget(self, outlet: Connection) -> None:
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
        """Return the watchers that get the message which has just left a port; count it."""
        return [each for each in self._all.values() if each.wants(port)]

    def _new(self, outlet: Connection) -> Watcher:
        if len(self._all) >= MOST:
            raise Refusal(f"{MOST} others watch already", expected="some to stop or to fall silent")
        watcher = self._all[outlet] = Watcher(outlet)
        return watcher

    def _find_first_end(self) -> None:
        self._first_ends_at = min((each.until for each in self._all.values()), default=NEVER)


ROOM_FOR_ANSWERS: Final = 64
"""How many answers may wait to be sent."""
RESERVE: Final = 200 * MICROSECOND
"""Nothing more is sent when the next event is as near as this, ns."""


class Outgoing:
    """Answers and messages that are to be sent; `sent` and `dropped` count them."""

    def __init__(self, executive: Executive, ports: Ports, now: Callable[[], int]) -> None:
        self.sent = 0
        self._dropped = 0
        self._ports = ports
        self._watchers = Watchers(now)
        self._taps = Taps(executive.simulator)
        self._answers: deque[tuple[Connection, dict[str, object]]] = deque()
        self._run_now = executive.clock.now

    @property
    def dropped(self) -> int:
        """How many found no room, here or where they were to go."""
        return self._dropped + self._taps.lost

    def watch(self, connection: Connection, asked: Watch) -> None:
        """Send these ports' messages from now on, and no others. Raises Refusal."""
        self._ports.watched(asked.watch)
        self._watchers.renew(connection, asked.watch, asked.every)
        self._open_taps()
        self.answer(connection, watching=asked.watch, for_s=WATCHED_FOR // SECOND)

    def answer(self, connection: Connection, **what: object) -> None:
        """Send this when there is time."""
        if len(self._answers) < ROOM_FOR_ANSWERS:
            self._answers.append((connection, what))
        else:
            self._dropped += 1

    def send(self, connection: Connection, message: bytes) -> bool:
        """Send at once; whether there is a reader still."""
        try:
            connection.send(message)
        except OSError as error:
            self._dropped += 1
            return isinstance(error, BlockingIOError)
        self.sent += 1
        return True

    def forget(self, connection: Connection) -> None:
        """Send its messages to that connection no more."""
        self._watchers.forget(connection)
        self._open_taps()

    def between_steps(self, now: int, left: int) -> None:
        """Send what is to be sent, as far as there is time."""
        if self._watchers.forget_silent():
            self._open_taps()
        if self._answers or self._taps.sent:
            self._send_waiting(now + left - RESERVE)

    def _send_waiting(self, until: int) -> None:
        while self._run_now() < until:
            if self._answers:
                connection, what = self._answers.popleft()
                self.send(connection, message_of(**what))
            elif self._taps.sent:
                self._pass_on(*self._taps.sent.popleft())
            else:
                return

    def _pass_on(self, path: str, at: int, value: object) -> None:
        watchers = self._watchers.of(path)
        if not watchers:
            return
        try:
            message = message_of(port=path, t_ns=at, value=value)
        except Exception:  # noqa: BLE001 -- a value without a form in JSON must not end the run
            self._dropped += len(watchers)
            return
        for watcher in watchers:
            if not self.send(watcher.outlet, message):
                self.forget(watcher.outlet)

    def _open_taps(self) -> None:
        self._taps.open(self._ports.watched(self._watchers.ports))
