"""The ports of a model that others may write and watch, by the names they go by in datagrams."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from msgspec import Raw, Struct
from msgspec.json import decode

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import ports_below
from firmware_runtime.devs.ports import InPort, OutPort
from firmware_runtime.errors import did_you_mean, with_article
from firmware_runtime.links.leaf_values import PLAIN, Form
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.typed_values import json_form

if TYPE_CHECKING:
    from firmware_runtime.devs.part import Part

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


def entry_of(port: InPort[object]) -> Entry:
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

    def of_part(self, part: "Part", other: str) -> "Ports":
        """Return those of a part of this model; where it was cut is no port of it.

        `other` is the name of the run that has the rest.
        """
        found = Ports(part.model)
        found.entries = {name: each for name, each in found.entries.items() if name in self.entries}
        found.outputs = {name: each for name, each in found.outputs.items() if name in self.outputs}
        found.elsewhere = dict.fromkeys(self.entries.keys() - found.entries.keys(), other)
        return found

    def arrival(self, name: str, value: Raw) -> tuple[InPort[object], object]:
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

    def watched(self, paths: Iterable[str]) -> dict[str, OutPort[object]]:
        """The output ports at these paths. Raises Refusal."""
        found: dict[str, OutPort[object]] = {}
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
