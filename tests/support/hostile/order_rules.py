"""Which values enter, and in which order, by docs/wire.md, in words of its own.

Port 0 carries motions, port 2 yaws: of both the newest counts. Port 1 carries turns, which all
enter, in order.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from tests.support.hostile.frames import (
    BAD_MOTIONS,
    BAD_YAWS,
    MOTIONS,
    TURNS,
    YAWS,
    Entry,
    Fields,
    entries_of,
)

PORTS: Final[dict[int, tuple[Mapping[bytes, object], Mapping[bytes, str]]]] = {
    0: (MOTIONS, BAD_MOTIONS),
    1: (TURNS, {}),
    2: (YAWS, BAD_YAWS),
}
"""By port: values that are taken, with what they are, and those that are not, with the reason."""
ORDERED: Final = 1
MOST_WAITING: Final = 256


@dataclass
class Came:
    """What came of a step, by port: sequence, what it comes after, values."""

    origin: int
    parts: dict[int, tuple[int, int, list[object]]]


@dataclass
class OrderRules:
    """What the receiving end does with steps that it has accepted."""

    timeout: int
    values: list[tuple[int, object]] = field(default_factory=list)
    """By port, all that has entered."""
    overtaken: int = 0
    dropped: int = 0
    _waiting: list[Came] = field(default_factory=list)
    _known: dict[int, set[int]] = field(default_factory=dict)
    _entered: dict[int, int] = field(default_factory=dict)
    _lost: bool = False
    _entering: list[tuple[int, list[object]]] = field(default_factory=list)
    """By port, what enters in this pass."""

    def begin_again(self) -> None:
        """There is another peer."""
        self._waiting, self._known, self._entered = [], {}, {}

    def newest(self, port: int) -> float:
        """The highest sequence of a port that has come or was given up; infinity of no port."""
        if port not in PORTS:
            return float("inf")
        return max(self._entered.get(port, 0), *self._known.get(port, ()), 0)

    def has_lost(self) -> bool:
        """Whether a turn was lost for good since the last call."""
        lost, self._lost = self._lost, False
        return lost

    def take(self, fields: Fields, clock: int) -> str:  # noqa: C901 -- the rules in their order
        """Why a step is refused; empty if it is not."""
        entries = entries_of(fields)
        if entries is None:
            return "malformed"
        if any(entry.port not in PORTS for entry in entries):
            return "unknown_port"
        values = {}
        for entry in entries:
            if not self._is_known(entry):
                found = values_of(entry)
                if isinstance(found, str):
                    return found
                values[entry.port] = (entry.sequence, entry.after, found)
        late = {port for port in values if values[port][0] <= self._entered.get(port, 0)}
        for port in late:
            self.overtaken += len(values[port][2])
            self._note(port, values.pop(port)[0])
        if values and clock - fields.origin > self.timeout:
            for port, (sequence, _, _) in values.items():  # nothing waits for it
                self._entered[port] = max(sequence, self._entered.get(port, 0))
            self._release()
            return "too_old"
        for port, (sequence, _, _) in values.items():
            self._note(port, sequence)
        if values:
            self._waiting.append(Came(fields.origin, values))
            self._release()
            if len(self._waiting) > MOST_WAITING:
                self._drop(self._waiting[0])
                self._release()
        return ""

    def expire(self, clock: int) -> None:
        """Give up what has waited too long, the first that came first."""
        for each in list(self._waiting):
            if each in self._waiting and clock - each.origin > self.timeout:
                self._drop(each)
        self._release()

    def _drop(self, came: Came) -> None:
        self._waiting.remove(came)
        self._lost = True
        for port, (sequence, _, values) in came.parts.items():
            self._entered[port] = max(sequence, self._entered.get(port, 0))
            self.dropped += len(values)

    def _release(self) -> None:
        while ready := [each for each in self._waiting if not self._waits(each)]:
            self._waiting.remove(ready[0])
            self._enter(ready[0])

    def _waits(self, came: Came) -> bool:
        return ORDERED in came.parts and came.parts[ORDERED][1] > self._entered.get(ORDERED, 0)

    def _enter(self, came: Came) -> None:
        for port, (sequence, _, values) in came.parts.items():
            before = self._entered.get(port, 0)
            if sequence <= before:
                self.overtaken += len(values)
                continue
            self._lost |= port == ORDERED and 0 < before < sequence - 1
            self._entered[port] = sequence
            self._entering.append((port, values))

    def settle(self) -> None:
        """The pass is over: of what entered in it the newest of a port count, but all turns."""
        entering, self._entering = self._entering, []
        newest = {port: number for number, (port, _) in enumerate(entering)}
        for number, (port, values) in enumerate(entering):
            if port == ORDERED or newest[port] == number:
                self.values += [(port, value) for value in values]
            else:
                self.dropped += len(values)

    def _note(self, port: int, sequence: int) -> None:
        self._known.setdefault(port, set()).add(sequence)

    def _is_known(self, entry: Entry) -> bool:
        """Whether it has come, as far back as 1024 below the highest."""
        known = self._known.get(entry.port, set())
        return entry.sequence in known and max(known) - entry.sequence <= 1024


def values_of(entry: Entry) -> list[object] | str:
    """The values of an entry: an array of 1 to 15; or why it is refused."""
    good, bad = PORTS[entry.port]
    count, rest = entry.values[:1], entry.values[1:]
    if not count or not 0x91 <= count[0] <= 0x9F:
        return "malformed"
    found: list[object] = []
    for _ in range(count[0] - 0x90):
        value = next((each for each in good if rest.startswith(each)), None)
        if value is None:
            return bad.get(rest, "malformed")
        found.append(good[value])
        rest = rest[len(value) :]
    return "malformed" if rest else found
