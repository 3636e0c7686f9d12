"""The ports of a model that others may write and watch, by the names they go by in datagrams."""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import Any, Final, TypeAlias

from msgspec import Raw, Struct

from firmware_runtime.devs.component import Component, below_root
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.listening import Listening
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.errors import did_you_mean, with_article
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.forms import form_of
from firmware_runtime.links.ports.values import Read, reader_of


class Entry(Struct, frozen=True):
    """An input port of the top model; `read` is None if no datagram can bear its type."""

    port: InPort[Any]
    read: Read | None


class Ports:
    """Input ports of the top model, and the output ports of every component below it.

    Of one end of a robot in two processes, `elsewhere` has the input ports of the other end alone,
    and how that end's run is called.
    """

    def __init__(self, root: Component) -> None:
        self.elsewhere: dict[str, str] = {}
        self.entries = {
            port.name: Entry(port, reader_of(port.type)) for port in root.in_ports.values()
        }
        self.outputs: dict[str, OutPort[Any]] = {
            below_root(port.path): port
            for component in with_all_below(root)
            for port in component.out_ports.values()
        }

    def of_part(self, part: Part, other: str) -> "Ports":
        """Those of them that are in a part of this model; where it was cut is no port of it.

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
        if entry.read is None:
            kind = entry.port.type.__name__
            raise Refusal(f"a value of {kind} cannot be sent", where=name, expected="another port")
        try:
            return entry.port, entry.read(value)
        except Refusal as why:
            form = form_of(entry.port.type)
            expected = "" if form is None else f"; expected {form}"
            raise Refusal(
                f"not {with_article(entry.port.type.__name__)}: {why}{expected}", where=name
            ) from why

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
                    expected="one that `firmware-runtime ports` shows"
                    f"{did_you_mean(path, self.outputs)}",
                )
            found[path] = self.outputs[path]
        return found

    def listing(self) -> list[dict[str, str]]:
        """Name, direction and type of each, and of what enters as a record its `value`'s form."""
        entering = [
            {"name": name, "direction": "in", "type": entry.port.type.__name__, **_form(entry)}
            for name, entry in self.entries.items()
        ]
        leaving = [
            {"name": path, "direction": "out", "type": port.type.__name__}
            for path, port in self.outputs.items()
        ]
        return [*entering, *leaving]


def _form(entry: Entry) -> dict[str, str]:
    form = None if entry.read is None else form_of(entry.port.type)
    return {} if form is None else {"value": form}


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
