"""Outgoing messages of a run's socket: answers, and what the ports that are watched send.

Nothing is sent but when the loop has time, except the answer to a request; nothing waits for a
reader: what finds no room, here or in its connection, is dropped and counted. Each watcher has a
connection of its own, because the kernel counts by sender: what waits unread takes room from the
socket that sent it. With one socket for all, a reader that never reads would in the end silence the
others. A port is listened to while it is watched; one that is not costs nothing.
"""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Final

from msgspec import Struct

from firmware_runtime.devs.ports import Listening, OutPort
from firmware_runtime.devs.time import MICROSECOND, NEVER, SECOND
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.local_socket import Connection
from firmware_runtime.links.ports.datagrams import WATCHED_FOR, Refusal, Watch, message_of
from firmware_runtime.links.ports.ports import Ports

ROOM: Final = 256
"""How many messages may wait to be sent on; then the oldest makes room."""
ROOM_FOR_ANSWERS: Final = 64
"""How many answers may wait to be sent."""
MOST: Final = 16
"""How many may watch at a time."""
RESERVE: Final = 200 * MICROSECOND
"""Nothing more is sent when the next event is as near as this, ns."""


class _Watcher(Struct):
    """One reader; `seen` counts the messages of each port it watches."""

    every: int = 1
    until: int = NEVER
    seen: dict[str, int] = {}

    def wants(self, port: str) -> bool:
        """Return whether this message is one to be sent; the first is."""
        if port not in self.seen:
            return False
        self.seen[port] += 1
        return self.seen[port] % self.every == 1 % self.every


class Outgoing:
    """Answers and messages that are to be sent; `sent` and `dropped` count them.

    `now` is any clock in ns that does not stand still.
    """

    def __init__(self, executive: Executive, ports: Ports, now: Callable[[], int]) -> None:
        self.sent = self.dropped = 0
        self._ports = ports
        self._now = now
        self._run_now = executive.clock.now
        self._simulator = executive.simulator
        self._answers: deque[tuple[Connection, dict[str, object]]] = deque()
        self._messages: deque[tuple[str, int, object]] = deque(maxlen=ROOM)
        """Path of a port, instant in ns and value of what was sent there."""
        self._watchers: dict[Connection, _Watcher] = {}
        self._first_ends_at = NEVER
        self._watched: Mapping[str, OutPort[object]] = {}
        self._listening: list[Listening] = []

    def watch(self, connection: Connection, asked: Watch) -> None:
        """Send these ports' messages from now on, and no others. Raises Refusal."""
        self._ports.watched(asked.watch)
        if asked.watch:
            self._renew(connection, asked.watch, asked.every)
            self._listen()
        else:
            self.forget(connection)
        self.answer(connection, watching=asked.watch, for_s=WATCHED_FOR // SECOND)

    def answer(self, connection: Connection, **what: object) -> None:
        """Send this when there is time."""
        if len(self._answers) < ROOM_FOR_ANSWERS:
            self._answers.append((connection, what))
        else:
            self.dropped += 1

    def send(self, connection: Connection, message: bytes) -> bool:
        """Send at once; whether there is a reader still."""
        try:
            connection.send(message)
        except OSError as error:
            self.dropped += 1
            return isinstance(error, BlockingIOError)
        self.sent += 1
        return True

    def forget(self, *connections: Connection) -> None:
        """Send its messages to that connection no more."""
        for each in connections:
            self._watchers.pop(each, None)
        self._listen()

    def between_steps(self, now: int, left: int) -> None:
        """Send what is to be sent, as far as there is time."""
        if (instant := self._now()) >= self._first_ends_at:
            self.forget(*[by for by, each in self._watchers.items() if each.until <= instant])
        until = now + left - RESERVE
        while (self._answers or self._messages) and self._run_now() < until:
            if self._answers:
                connection, what = self._answers.popleft()
                self.send(connection, message_of(**what))
            else:
                self._pass_on(*self._messages.popleft())

    # The watchers ---------------------------------------------------------------------------------

    def _renew(self, connection: Connection, ports: Iterable[str], every: int) -> None:
        """Add a watcher, or note what it watches now. Raises Refusal if there are too many."""
        watcher = self._watchers.get(connection)
        if watcher is None and len(self._watchers) >= MOST:
            raise Refusal(f"{MOST} others watch already", expected="some to stop or to fall silent")
        watcher = self._watchers[connection] = watcher or _Watcher()
        seen = watcher.seen if watcher.every == every else {}
        watcher.seen = {port: seen.get(port, 0) for port in ports}
        watcher.every, watcher.until = every, self._now() + WATCHED_FOR

    def _listen(self) -> None:
        """Listen to the ports that are watched, each once, and to no others."""
        self._first_ends_at = min((each.until for each in self._watchers.values()), default=NEVER)
        paths = dict.fromkeys(path for each in self._watchers.values() for path in each.seen)
        if (watched := self._ports.watched(paths)) == self._watched:
            return
        for listening in self._listening:
            listening.end()
        listen = self._simulator.listen
        self._watched = watched
        self._listening = [
            listen(port, partial(self._take, path)) for path, port in watched.items()
        ]

    def _take(self, path: str, at: int, value: object) -> None:
        if len(self._messages) == ROOM:
            self.dropped += 1
        self._messages.append((path, at, value))

    def _pass_on(self, path: str, at: int, value: object) -> None:
        watchers = [by for by, each in self._watchers.items() if each.wants(path)]
        if not watchers:
            return
        try:
            message = message_of(port=path, t_ns=at, value=value)
        except Exception:  # noqa: BLE001 -- a value without a form in JSON must not end the run
            self.dropped += len(watchers)
            return
        for connection in watchers:
            if not self.send(connection, message):
                self.forget(connection)
