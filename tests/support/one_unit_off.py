"""A replay in which one float is the next one: of the state, of what enters or of what leaves."""

import dataclasses
import math
from collections.abc import Iterator
from contextlib import suppress
from random import Random
from typing import Any, Literal, NamedTuple

import pytest
from msgspec import MsgspecError, structs

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.part import Part, part_of
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, Owner
from firmware_runtime.part_recording import replay as replaying
from firmware_runtime.part_recording.comparison import Comparison, compare
from firmware_runtime.part_recording.recording import Recording
from firmware_runtime.part_recording.records import Entered, Left, Postponed, Retuned, State
from firmware_runtime.part_recording.replay import Event, Retune, _Replay
from firmware_runtime.recording.values import made, pack, plain, unpack

Path = tuple[str, ...]


class Spot(NamedTuple):
    """A float of a recording: in which record, and by which names of fields it is reached."""

    what: Literal["input", "state", "output"]
    record: int
    at: int
    name: str
    """Of the port, or of the field of a model's state."""
    path: Path

    @property
    def full_name(self) -> str:
        return ".".join((self.name, *self.path))


def spots(recording: Recording) -> Iterator[Spot]:
    """Every float of a recording."""
    header = recording.header
    entering, leaving = list(header.entering), list(header.leaving)
    for number, record in enumerate(recording.records):
        if isinstance(record, Entered):
            for path in _floats(made(record.value)):
                yield Spot("input", number, record.at, entering[record.name], path)
        elif isinstance(record, Left):
            for path in _floats(made(record.value)):
                yield Spot("output", number, record.at, leaving[record.name], path)
        elif isinstance(record, State):
            for name, content in record.fields.items():
                if _holds_float(content):
                    yield Spot("state", number, record.at, name, ())


def _holds_float(content: bytes) -> bool:
    """Whether a field of a state has a float somewhere in it."""
    waiting: list[Any] = [content]
    while waiting:
        form = waiting.pop()
        if isinstance(form, float):
            return True
        if isinstance(form, bytes):
            with suppress(MsgspecError):
                waiting.append(unpack(form))
        elif isinstance(form, list):
            waiting += form
        elif isinstance(form, dict):
            waiting += form.values()
    return False


def chosen(recording: Recording, what: str, count: int, source: Random) -> list[Spot]:
    """So many spots of a kind, spread over ports, fields and time by a seed."""
    of_kind = [spot for spot in spots(recording) if spot.what == what]
    names = sorted({(spot.name, spot.path) for spot in of_kind})
    found: dict[Spot, None] = {}
    while len(found) < count:
        name = source.choice(names)
        found[source.choice([each for each in of_kind if (each.name, each.path) == name])] = None
    return [*found]


def replayed_off(recording: Recording, board: Board, spot: Spot) -> tuple[Comparison, Spot]:
    """The comparison of a recording with a replay that is off there, and which float it was."""
    robot = board.unconnected()
    part = part_of(robot.model, recording.header.components)
    off = _Off(recording, part, robot.retune, spot)
    return compare(recording, off.run()), spot._replace(path=off.path)


class _Off(_Replay):
    def __init__(self, recording: Recording, part: Part, retune: Retune, spot: Spot) -> None:
        self.path = spot.path
        self._spot = spot
        self._left = 0
        before = recording.records[: spot.record]
        self._event = sum(isinstance(each, Left) for each in before)
        self._target = recording.records[spot.record]
        super().__init__(recording, part.model, retune)

    def _cross(self, record: Entered | Left) -> None:
        if record is not self._target or not isinstance(record, Entered):
            super()._cross(record)
            return
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(
                replaying, "made_for", lambda _name, form: nudged(made(form), self._spot.path)
            )
            super()._cross(record)

    def _apply(self, record: Retuned | Postponed | State) -> None:
        if record is self._target:
            self._nudge_state()
        super()._apply(record)

    def _nudge_state(self) -> None:
        model, _, field = self._spot.name.rpartition(".")
        atomic = self._atomics[model]
        value = getattr(atomic, field)
        paths = _floats(value)
        self.path = paths[self._spot.record % len(paths)]
        setattr(atomic, field, nudged(value, self.path))

    def _listen(self, name: str, port: AnyPort) -> None:
        def left(at: int, value: object) -> None:
            is_there = self._spot.what == "output" and self._left == self._event
            self._left += 1
            form = plain(nudged(value, self._spot.path) if is_there else value)
            self._result.replayed.append(Event(at, name, form, pack(form)))

        self._player.listen(port, left)


def nudged(value: Any, path: Path) -> Any:  # noqa: ANN401 -- whatever a port carries
    """The same value with the float at a path replaced by the next one."""
    if not path:
        return math.nextafter(value, -math.inf if value == math.inf else math.inf)
    first, rest = path[0], path[1:]
    parts = dict(_parts(value))
    parts[first] = nudged(parts[first], rest)
    if isinstance(value, tuple):
        return tuple.__new__(type(value), parts.values())
    if isinstance(value, list):
        return [*parts.values()]
    if hasattr(value, "__struct_fields__"):
        return structs.replace(value, **parts)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return dataclasses.replace(value, **parts)
    setattr(value, first, parts[first])
    return value


def _floats(value: Any, depth: int = 4) -> list[Path]:  # noqa: ANN401 -- as above
    """Where a value holds floats."""
    if isinstance(value, float):
        return [()]
    if depth == 0:
        return []
    return [(name, *path) for name, part in _parts(value) for path in _floats(part, depth - 1)]


def _parts(value: Any) -> list[tuple[str, Any]]:  # noqa: ANN401 -- as above
    """The fields, items or attributes of a value, by name."""
    if isinstance(value, tuple | list):
        names = getattr(value, "_fields", [str(number) for number in range(len(value))])
        return [*zip(names, value, strict=True)]
    if hasattr(value, "__struct_fields__"):
        return [(name, getattr(value, name)) for name in value.__struct_fields__]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return [(each.name, getattr(value, each.name)) for each in dataclasses.fields(value)]
    if callable(value) or isinstance(value, InPort | OutPort | Owner | type):
        return []
    return [*getattr(value, "__dict__", {}).items()]
