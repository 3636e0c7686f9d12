"""The ports of a model that others may write and watch, by the names they go by in datagrams."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, TypeAlias

from msgspec import Raw, Struct
from msgspec.json import decode

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import InPort, Listening, OutPort
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import did_you_mean, with_article
from firmware_runtime.links.leaf_values import PLAIN, Form
from firmware_runtime.links.local_socket import Connection
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.typed_values import json_form

LONGEST_FORM: Final = 400
"""Letters; the text of a form that is longer is cut."""


class Entry(Struct, frozen=True):
    """An input port of the top model; `form` is None if no datagram can bear its type."""

    port: InPort[Any]
    form: Form | None

    @property
    def text(self) -> str:
        """Form of a value in JSON; empty for a plain one, which its type's name says."""
        if self.form is None or self.port.type in PLAIN:
            return ""
        text = self.form.text
        return text if len(text) <= LONGEST_FORM else f"{text[:LONGEST_FORM]}..."


def entry_of(port: InPort[Any]) -> Entry:
    """Return how values enter by a port."""
    try:
        return Entry(port, json_form(port.type))
    except (TypeError, NameError, RecursionError):  # hints that lead nowhere, too
        return Entry(port, None)


class Ports:
    """Input ports of the top model, and the output ports of every component below it.

    Of one end of a robot in two processes, `elsewhere` has the input ports of the other end alone,
    and how that end's run is called.
    """

    def __init__(self, root: Component) -> None:
        self.elsewhere: dict[str, str] = {}
        self.entries = {port.name: entry_of(port) for port in root.in_ports.values()}
        self.outputs = ports_below(root)

    def of_part(self, part: Part, other: str) -> "Ports":
        """Return those of a part of this model; where it was cut is no port of it.

        `other` is the name of the run that has the rest.
        """
        found = Ports(part.model)
        found.entries = {name: each for name, each in found.entries.items() if name in self.entries}
        found.outputs = {name: each for name, each in found.outputs.items() if name in self.outputs}
        found.elsewhere = dict.fromkeys(self.entries.keys() - found.entries.keys(), other)
        return found

    def arrival(self, name: str, value: Raw) -> tuple[InPort[Any], object]:
        """An input port, and the value for it that a datagram bears. Raises Refusal."""
        entry = self.entries.get(name)
        if entry is None:
            raise Refusal(self._why_not(name), where=name)
        kind = entry.port.type.__name__
        if entry.form is None:
            raise Refusal(f"a value of {kind} cannot be sent", where=name, expected="another port")
        try:
            return entry.port, entry.form.unpack(decode(value))
        except Exception as error:  # what is malformed, and what a board's own class does not take
            found = f"not {with_article(kind)}: {str(error) or type(error).__name__}"
            raise Refusal(found, where=name, expected=entry.text) from error

    def _why_not(self, name: str) -> str:
        if name in self.elsewhere:
            other = self.elsewhere[name]
            return f"leads to no model of this end; expected `send {other} {name}=VALUE`"
        if not self.entries:
            return "no such input port of the top model, which has none here"
        known = ", ".join(self.entries)
        return f"no such input port of the top model; expected one of {known}"

    def watched(self, paths: Iterable[str]) -> dict[str, OutPort[Any]]:
        """The output ports at these paths. Raises Refusal."""
        found: dict[str, OutPort[Any]] = {}
        for path in paths:
            if path not in self.outputs:
                raise Refusal(
                    "no such output port",
                    where=path,
                    expected="one that `show BOARD --ports` shows"
                    f"{did_you_mean(path, self.outputs)}",
                )
            found[path] = self.outputs[path]
        return found

    def listing(self) -> list[dict[str, str]]:
        """Name, direction and type of each, and of what enters as a record its `value`'s form."""
        entering = [
            {
                "name": name,
                "direction": "in",
                "type": entry.port.type.__name__,
                **({"value": entry.text} if entry.text else {}),
            }
            for name, entry in self.entries.items()
        ]
        leaving = [
            {"name": path, "direction": "out", "type": port.type.__name__}
            for path, port in self.outputs.items()
        ]
        return [*entering, *leaving]


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

    def __len__(self) -> int:
        return len(self._all)

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
