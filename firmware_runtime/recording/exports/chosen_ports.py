"""The ports of a recorded run that are chosen by name, and fields of their values."""

from collections.abc import Sequence

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.senders import Senders
from firmware_runtime.errors import ConfigError, did_you_mean
from firmware_runtime.recording.blackbox.ring_file import Header
from firmware_runtime.recording.exports.typed_values import entrance


class ChosenPorts:
    """All that go by these names; a coupled model's port means those that send through it.

    A name may have that of a field behind it, such as `imu.sample.rate.2`. Raises ConfigError.
    """

    def __init__(self, names: Sequence[str], header: Header, model: Coupled) -> None:
        known = [*header.ports, *map(entrance, model.in_ports)]
        senders = Senders(model)
        self._fields: dict[str, set[str]] = {}
        """By port, fields of it; an empty name is all of them."""
        for name in names:
            found = _split(name, senders, set(known))
            if found is None:
                fault = f"{name!r}: no such port in the recording{did_you_mean(name, known)}"
                raise ConfigError.of_one("--port", fault, expected=f"one such as {known[0]}")
            ports, field = found
            for port in ports:
                self._fields.setdefault(port, set()).add(field)

    def has(self, port: str) -> bool:
        """Return whether a port is one of them."""
        return port in self._fields

    def has_field(self, port: str, field: str) -> bool:
        """Return whether a field of a port's values is."""
        chosen = self._fields.get(port, ())
        return any(not each or f"{field}.".startswith(f"{each}.") for each in chosen)

    def shows(self, field: str) -> bool:
        """Return whether that field of one of them is."""
        return any(self.has_field(port, field) for port in self._fields)


def _split(name: str, senders: Senders, known: set[str]) -> tuple[Sequence[str], str] | None:
    """The ports that a name begins with, and the field behind them."""
    words = name.split(".")
    for count in range(len(words), 0, -1):
        ports = senders.of(".".join(words[:count]))
        if known.issuperset(ports):
            return ports, ".".join(words[count:])
    return None
