"""Where two states of a robot differ, floats to the bit."""

import struct
from collections.abc import Hashable, Iterator
from itertools import zip_longest
from typing import Any, Final, NamedTuple

from firmware_runtime.blackbox.state.known import KnownObjects
from firmware_runtime.blackbox.state.later import Known, NoValue, Value, reduced
from firmware_runtime.blackbox.state.layouts import Thing, by_name, layout_of
from firmware_runtime.blackbox.state.making import Making


class FieldDifference(NamedTuple):
    """One field that differs: `controller.yaw._integral`; a value that is not there is `ABSENT`."""

    path: str
    recorded: object
    present: object

    def __str__(self) -> str:
        return f"{self.path}: {self.recorded!r} was recorded; {self.present!r} is present"


class Absent:
    """In place of what one of two states does not have."""

    def __repr__(self) -> str:
        return "nothing"


ABSENT: Final = Absent()
_Pairs = Iterator[tuple[str, object, object]]


class StateComparison:
    """Compares what was read of files of one robot."""

    def __init__(self, known: KnownObjects) -> None:
        self._known = known
        self._seen: set[tuple[int, int]] = set()

    def between(self, path: str, recorded: Thing, present: Thing) -> Iterator[FieldDifference]:
        """What differs from here on."""
        for where, *pair in self._between(path, recorded, present):
            yield FieldDifference(where, *map(self._shown, pair))

    def _shown(self, read: Thing) -> object:
        """The object that stands for what was read; the latter where none can be made."""
        try:
            return Making(self._known.things, self._known.modules).of(read)
        except (NoValue, IndexError):
            return read

    def _between(self, path: str, recorded: Thing, present: Thing) -> _Pairs:
        recorded, present = self._alike(recorded, present)
        kind = type(recorded)
        if kind is not type(present):
            yield path, recorded, present
        elif kind in _INNER or kind is Value:
            pair = id(recorded), id(present)
            if pair not in self._seen:
                self._seen.add(pair)
                inner = self._of_value if kind is Value else self._of_container
                yield from inner(path, recorded, present)
        elif not _is_same(recorded, present):
            yield path, recorded, present

    def _alike(self, recorded: Thing, present: Thing) -> tuple[Thing, Thing]:
        """A constant that one has known and the other has made, each by its parts."""
        if type(recorded) is Known and type(present) is not Known:
            return self._by_value(recorded), present
        if type(present) is Known and type(recorded) is not Known:
            return recorded, self._by_value(present)
        return recorded, present

    def _by_value(self, known: Known) -> Thing:
        thing = self._known.things[known.number]
        if not layout_of(type(thing)).is_constant:
            return known
        try:
            return self._read(thing, known)
        except NoValue:
            return known

    def _read(self, thing: Thing, known: object = None) -> Thing:
        """An object as it would have been read of a file, known ones aside."""
        number = self._known.number_of(thing)
        if number is not None and known is None:
            return Known(number)
        if type(thing) in (tuple, frozenset):
            return type(thing)(self._read(each) for each in thing)
        if type(thing) in _PLAIN:
            return thing
        _, (what, kind), parts = reduced(thing)
        value = Value(what, self._read(kind))
        value.parts = self._read_parts(parts)
        return value

    def _read_parts(self, parts: Thing) -> Thing:
        if isinstance(parts, dict):
            return {key: self._read_parts(each) for key, each in parts.items()}
        if type(parts) in (list, tuple):
            return type(parts)(self._read_parts(each) for each in parts)
        return self._read(parts)

    def _of_container(self, path: str, recorded: Thing, present: Thing) -> _Pairs:
        if isinstance(recorded, set | frozenset):
            if exact(recorded) != exact(present):
                yield path, recorded, present
        elif isinstance(recorded, dict):
            yield from self._of_dict(path, recorded, present)
        else:
            pairs = zip_longest(recorded, present, fillvalue=ABSENT)
            for place, pair in enumerate(pairs):
                yield from self._between(f"{path}[{place}]", *pair)

    def _of_dict(self, path: str, recorded: Thing, present: Thing) -> _Pairs:
        old, new = ({exact(key): key for key in each} for each in (recorded, present))
        for same in [*old, *(each for each in new if each not in old)]:
            key = old[same] if same in old else new[same]
            was = recorded[key] if same in old else ABSENT
            yield from self._between(
                f"{path}[{key!r:.80}]", was, present[new[same]] if same in new else ABSENT
            )
        if [*old] != [*new] and old.keys() == new.keys():
            yield f"{path} (the order of its keys)", [*recorded], [*present]

    def _of_value(self, path: str, recorded: Value, present: Value) -> _Pairs:
        if {recorded.what, present.what} in _ARRAYS:
            if self._numbers_of(recorded) != self._numbers_of(present):
                yield path, recorded, present
        elif (recorded.what, recorded.kind) != (present.what, present.kind):
            yield path, recorded, present
        elif recorded.what in _WHOLE:
            if recorded.parts != present.parts:
                yield path, recorded, present
        elif recorded.what == "iterator":
            if any(self._between(path, recorded.parts, present.parts)):
                yield path, recorded, present
        elif recorded.what == "object":
            yield from self._of_object(path, recorded, present)
        else:
            yield from self._between(path, recorded.parts, present.parts)

    def _numbers_of(self, read: Value) -> object:
        """An array of numpy that may be a view of another, whatever else holds that one."""
        array: Any = self._shown(read)
        return (
            array if isinstance(array, Value) else (array.dtype.str, array.shape, array.tobytes())
        )

    def _of_object(self, path: str, recorded: Value, present: Value) -> _Pairs:
        (content, *slots_of_one), (other, *slots_of_other) = recorded.parts, present.parts
        yield from self._between(path, content, other)
        layout = layout_of(Making(self._known.things, self._known.modules).kind_of(recorded))
        for old, new in zip(slots_of_one, slots_of_other, strict=True):
            named = (by_name(layout, each or {}) for each in (old, new))
            yield from self._of_fields(path, *named)

    def _of_fields(self, path: str, recorded: Thing, present: Thing) -> _Pairs:
        for name in [*recorded, *(name for name in present if name not in recorded)]:
            pair = recorded.get(name, ABSENT), present.get(name, ABSENT)
            yield from self._between(f"{path}.{name}", *pair)


_INNER: Final = (list, tuple, dict, set, frozenset)
_PLAIN: Final = (type(None), bool, int, float, str, bytes)
_WHOLE: Final = ("array", "number", "numbers", "member", "class", "function", "count")
_ARRAYS: Final = ({"part"}, {"part", "array"})
_DOUBLE: Final = struct.Struct("<d")


def _is_same(recorded: Any, present: Any) -> bool:  # noqa: ANN401 -- any two objects of one class
    if type(recorded) in (float, complex):
        return exact(recorded) == exact(present)
    are_no_numbers = recorded != recorded and present != present  # noqa: PLR0124 -- of numpy
    return bool(recorded == present or are_no_numbers)


def exact(read: Thing) -> Hashable:  # noqa: PLR0911 -- one for each class
    """What is equal for what is the same: floats to the bit, a set without its order."""
    kind = type(read)
    if kind is float:
        return kind, _DOUBLE.pack(read)
    if kind is complex:
        return kind, _DOUBLE.pack(read.real), _DOUBLE.pack(read.imag)
    if kind in (tuple, list):
        return kind, *map(exact, read)
    if kind in (set, frozenset):
        return kind, frozenset(map(exact, read))
    if kind is dict:
        return kind, *((exact(key), exact(value)) for key, value in read.items())
    if kind is bytearray:
        return kind, bytes(read)
    if kind is Value:
        return read.what, exact(read.kind), exact(read.parts)
    return kind, read
