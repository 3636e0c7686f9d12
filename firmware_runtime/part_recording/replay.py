"""The replay: what entered a part of a model enters a fresh one, at the same instants and rounds.

Virtual time, so it takes as long as the part computes. Between two recorded visits the part's own
events take place at their instants. Gains that were changed in the run, and events that were put
off because they were late, are changed and put off again.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.errors import ModelError
from firmware_runtime.devs.ports import AnyPort
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.cut import Cut, cut_around, entrance_of, type_name
from firmware_runtime.part_recording.player import Entry, Player
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.records import (
    Ended,
    Entered,
    Header,
    Left,
    Postponed,
    Record,
    Retuned,
    State,
)
from firmware_runtime.part_recording.states import States
from firmware_runtime.recording.values import encoded, made_for, pack, plain

Retune: TypeAlias = Callable[[Any], None]
"""Gives the part the gains and limits of the settings that were recorded."""


@dataclass(frozen=True, slots=True)
class Event:
    """One output event; `content` is its value as bytes, by which it is compared."""

    at: int
    port: str
    value: Any
    content: bytes


@dataclass(frozen=True, slots=True)
class StateDifference:
    """A field of the part's state that was another in the replay, at the first such instant."""

    at: int
    field: str
    recorded: bytes
    replayed: bytes


@dataclass(frozen=True, slots=True)
class InputDifference:
    """A value that did not enter as it was recorded: what was made of the file is another."""

    at: int
    port: str
    recorded: bytes
    replayed: bytes


@dataclass(slots=True)
class Replayed:
    """What a replay made of a recording."""

    recorded: list[Event] = field(default_factory=list)
    replayed: list[Event] = field(default_factory=list)
    inputs: int = 0
    input: InputDifference | None = None
    fields: int = 0
    """Recorded fields of the part's state that were compared."""
    state: StateDifference | None = None
    failure: ModelError | None = None
    """What a model raised, if one did."""


def replay(recording: Recording, part: Coupled, retune: Retune) -> Replayed:
    """Run a fresh part of a model on a recording; the part is used up.

    Raises ConfigError if the part does not have the ports that the recording names.
    """
    return _Replay(recording, part, retune).run()


class _Replay:
    """One replay."""

    def __init__(self, recording: Recording, part: Coupled, retune: Retune) -> None:
        header = recording.header
        cut = cut_around(part, tuple(part.components))
        self._entering = list(header.entering)
        self._entrances = _entrances(header, part)
        self._names = list(_leaving(header, cut))
        self._recording = recording
        self._player = Player(part)
        self._atomics = {below_root(atomic.path): atomic for atomic in cut.atomics}
        self._retune = retune
        self._states, self._fields = States(cut.atomics), _Fields()
        self._result = Replayed()
        self._entries: list[Entry] = []
        self._visit = (0, -1)
        for name, port in cut.leaving.items():
            self._listen(name, port)

    def run(self) -> Replayed:
        """Work off every record, then what the part still had to do when the run ended."""
        try:
            for record in self._recording.records:
                self._take(record)
            self._play()
        except ModelError as error:
            self._result.failure = error
        return self._result

    def _take(self, record: Record) -> None:
        if isinstance(record, Entered | Left):
            self._come_to(record.at, record.visit)
            self._cross(record)
        elif isinstance(record, Retuned | Postponed | State):
            self._come_to(record.at, record.visit)
            self._play()
            self._apply(record)
        elif isinstance(record, Ended):
            self._come_to(record.at, record.visit)

    def _come_to(self, at: int, visit: int) -> None:
        """Work off everything before this visit."""
        if (at, visit) != self._visit:
            self._play()
            self._visit = (at, visit)
        if visit >= 0:
            self._run_before(at if visit == 0 else at + 1)

    def _run_before(self, at: int) -> None:
        while (due := self._player.next_at) < min(at, NEVER):
            self._player.advance(due)

    def _cross(self, record: Entered | Left) -> None:
        if isinstance(record, Left):
            name = self._names[record.name]
            value = record.value
            self._result.recorded.append(Event(record.at, name, value, pack(value)))
            return
        position, port = self._entrances[record.name]
        name = self._entering[record.name]
        value = made_for(name, record.value)
        self._result.inputs += 1
        if (recorded := pack(record.value)) != (entering := encoded(value)):
            difference = InputDifference(record.at, name, recorded, entering)
            self._result.input = self._result.input or difference
        self._entries.append(Entry(record.round, position, port, value))

    def _play(self) -> None:
        """Work off the visit that was come to, with all that entered in it."""
        at, visit = self._visit
        entries, self._entries = self._entries, []
        if entries:
            self._player.play(at, entries)
        elif visit >= 0 and self._player.next_at <= at:
            self._player.advance(at)

    def _apply(self, record: Retuned | Postponed | State) -> None:
        if isinstance(record, Retuned):
            self._retune(made_for("settings", record.settings))
        elif isinstance(record, State):
            self._result.fields += len(record.fields)
            difference = self._fields.difference(record, self._states.changed())
            self._result.state = self._result.state or difference
        elif (atomic := self._atomics.get(record.path)) is not None:
            self._player.postpone(atomic, record.until)

    def _listen(self, name: str, port: AnyPort) -> None:
        def left(at: int, value: object) -> None:
            form = plain(value)
            self._result.replayed.append(Event(at, name, form, pack(form)))

        self._player.listen(port, left)


class _Fields:
    """The fields of both sides, as far as they are known."""

    def __init__(self) -> None:
        self._recorded: dict[str, bytes] = {}
        self._replayed: dict[str, bytes] = {}

    def difference(self, record: State, changed: dict[str, bytes]) -> StateDifference | None:
        """The first field that both sides have and that differs after a visit."""
        self._recorded |= record.fields
        self._replayed |= changed
        for name, replayed in self._replayed.items():
            recorded = self._recorded.get(name, replayed)
            if recorded != replayed:
                return StateDifference(record.at, name, recorded, replayed)
        return None


def _entrances(header: Header, part: Coupled) -> list[tuple[int, Any]]:
    """Position and port of all that enters, in the header's order. Raises ConfigError."""
    faults: list[str] = []
    found: list[tuple[int, Any]] = []
    entering = zip(header.entering.items(), header.crossings, header.positions, strict=True)
    for (name, kind), crossing, position in entering:
        port = entrance_of(part, crossing)
        if port is None or type_name(port.type) != kind:
            is_now = "not there" if port is None else f"{type_name(port.type)} now"
            faults.append(f"{name}, of type {kind}, enters the part: {is_now}")
        found.append((position, port))
    if faults:
        raise ConfigError(f"recording of {header.board}", faults)
    return found


def _leaving(header: Header, cut: Cut) -> Iterable[str]:
    missing = [name for name in header.leaving if name not in cut.leaving]
    if missing:
        faults = [f"{name} leaves the part: not there" for name in missing]
        raise ConfigError(f"recording of {header.board}", faults)
    return header.leaving
