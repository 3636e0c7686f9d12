"""Writes values in MessagePack's types: see `values`."""

import random
from array import array
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable
from enum import Enum, EnumMeta
from typing import Any, Final, TypeAlias

import msgspec

from firmware_runtime.errors import text_of
from firmware_runtime.recording.records import (
    EXPECTED,
    UnknownValue,
    is_key,
    name_of,
    record_of,
    written_member,
)

Plain: TypeAlias = Any
"""Values that MessagePack has words for."""

encode: Final = msgspec.msgpack.Encoder().encode
_SAME: Final = frozenset({type(None), bool, float, str, bytes})
_SMALL: Final = range(-(1 << 63), 1 << 63)
DEEPEST: Final = 64
"""Values within values; more are refused, on writing and on reading."""
GENERATORS: Final = frozenset({"MT19937", "PCG64", "PCG64DXSM", "Philox", "SFC64"})
"""Generators of numpy whose state is written."""
_NUMBERS: Final = frozenset("biufc")
"""Kinds of numbers that an array may be of."""


class Writer:
    """Writes values of one robot at one instant.

    `number_of` gives the number of what is not written but named; with it, what can be changed and
    is met twice is written once.
    """

    __slots__ = ("_depth", "_memory", "_number_of", "_places")

    def __init__(self, number_of: Callable[[object], int | None] | None = None) -> None:
        self._number_of = number_of
        self._depth = 0
        self._places: dict[int, tuple[int, object]] = {}
        """The place of what can be changed, by its identity, which no other gets meanwhile."""
        self._memory: dict[int, int] = {}
        """By the owner of an array's memory, the array."""

    def plain(self, value: object) -> Plain:
        """A value in MessagePack's types. Raises UnknownValue."""
        return self._guarded(self.part, value)

    def content(self, value: object) -> Plain:
        """Return the content of a known container. Raises UnknownValue."""
        way = _way_of(dict if isinstance(value, dict) else type(value))
        return self._guarded(lambda of: way.write(of, self), value)

    def part(self, value: object) -> Plain:
        """A value within another; whatever it raises."""
        kind = type(value)
        if kind in _SAME:
            return value
        if kind is int:
            return value if value in _SMALL else {"int": [str(value)]}
        way = _FOUND.get(kind)
        is_named = self._number_of is not None and (way is None or way.is_shared)
        if is_named and (name := self._name_of(value)) is not None:
            return name
        if way is None:
            way = _way_of(kind)
        self._depth = depth = self._depth + 1
        if depth > DEEPEST:
            raise UnknownValue(f"over {DEEPEST} values within each other cannot be recorded")
        form = way.write(value, self)
        self._depth = depth - 1
        if is_named and way.is_shared:
            self._places[id(value)] = len(self._places), value
        return form

    def parts(self, values: Iterable[object]) -> list[Plain]:
        """Values in a row, as `part`."""
        same, part = _SAME, self.part
        return [value if type(value) in same else part(value) for value in values]

    def _name_of(self, value: object) -> Plain:
        """The form of what is known, or has been written before; None for anything else."""
        assert self._number_of is not None  # noqa: S101 -- as `part` has asked
        number = self._number_of(value)
        if number is not None:
            return {"known": [number]}
        found = self._places.get(id(value))
        return None if found is None else {"same": [found[0]]}

    def _guarded(self, write: Callable[[object], Plain], value: object) -> Plain:
        try:
            return write(value)
        except UnknownValue:
            raise
        except Exception as error:  # a function of the model's
            why = f"cannot be recorded ({type(error).__name__}: {text_of(error)}); {EXPECTED}"
            raise UnknownValue(f"{name_of(type(value))} {why}") from error
        finally:
            self._depth = 0

    def check_memory(self, of: Any) -> None:  # noqa: ANN401 -- an array of numpy
        """Raise UnknownValue for an array that sees what another one holds."""
        if self._number_of is None:
            return
        owner = of
        while getattr(owner, "base", None) is not None:
            owner = owner.base
        is_known = owner is not of and self._number_of(owner) is not None
        if is_known or self._memory.setdefault(id(owner), id(of)) != id(of):
            raise UnknownValue("an array that is a view of another; expected one of its own memory")


class _Way:
    """Writer of values of one class."""

    __slots__ = ("is_shared", "write")

    def __init__(self, write: Callable[[Any, Writer], Plain], *, is_shared: bool) -> None:
        self.write, self.is_shared = write, is_shared


def _way_of(kind: type[object]) -> _Way:
    """Return the writer of a class. Raises UnknownValue."""
    found = _FOUND.get(kind)
    if found is None:
        found = _FOUND[kind] = _new_way_of(kind)
    return found


_FOUND: Final[dict[type[object], _Way]] = {}


def _new_way_of(kind: type[object]) -> _Way:
    if kind in _WAYS:
        return _Way(_WAYS[kind], is_shared=kind not in _UNSHARED)
    if issubclass(kind, Enum) and type(kind) is EnumMeta:
        name = name_of(kind)
        return _Way(lambda value, _: {name: [written_member(value)]}, is_shared=False)
    if kind.__module__.partition(".")[0] == "numpy":
        return _way_of_numpy(kind)
    record = record_of(kind)
    return _Way(
        lambda value, writer: {record.name: writer.parts(record.values_of(value))},
        is_shared=record.is_shared,
    )


def _way_of_numpy(kind: type[object]) -> _Way:
    if kind.__name__ in GENERATORS:
        return _Way(
            lambda value, writer: {"generator": [kind.__name__, _stands(value, writer)]},
            is_shared=True,
        )
    if not hasattr(kind, "tobytes"):
        raise UnknownValue(f"{name_of(kind)} cannot be recorded; {EXPECTED}")
    return _Way(_of_numpy, is_shared=kind.__name__ == "ndarray")


def _stands(generator: Any, writer: Writer) -> Plain:  # noqa: ANN401 -- of numpy
    if getattr(generator.seed_seq, "n_children_spawned", 0):  # numpy counts them, and sets no count
        raise UnknownValue("a generator that others have been spawned from cannot be recorded")
    return writer.part(generator.state)


def _of_numpy(value: Any, writer: Writer) -> Plain:  # noqa: ANN401 -- numpy takes long to import
    if value.dtype.str[1:2] not in _NUMBERS:
        raise UnknownValue(f"an array of {value.dtype} cannot be recorded; expected one of numbers")
    if type(value).__name__ != "ndarray":
        return {"scalar": [value.dtype.str, [], value.tobytes()]}
    writer.check_memory(value)
    return {"array": [value.dtype.str, list(value.shape), value.tobytes()]}


def _pairs(name: str) -> Callable[[Any, Writer], Plain]:
    return lambda value, writer: {
        name: [
            [key if type(key) is str else _key(key, writer), writer.part(each)]
            for key, each in value.items()
        ]
    }


def _members(name: str) -> Callable[[Any, Writer], Plain]:
    """The items of a set have no order: the same set is the same bytes."""
    return lambda value, writer: {name: sorted((_key(each, writer) for each in value), key=encode)}


def _key(value: object, writer: Writer) -> Plain:
    form = writer.part(value)
    if not is_key(value) and not (isinstance(form, dict) and "known" in form):
        raise UnknownValue(
            f"{name_of(type(value))} as a key, or in a set, cannot be recorded; expected a number, "
            "text, enumeration or tuple"
        )
    return form


def _of_random(value: random.Random, _: Writer) -> Plain:
    version, words, gauss = value.getstate()
    return {"random": [version, array("I", words).tobytes(), gauss]}


_WAYS: Final[dict[type[object], Callable[[Any, Writer], Plain]]] = {
    tuple: lambda value, writer: writer.parts(value),
    list: lambda value, writer: {"list": writer.parts(value)},
    set: _members("set"),
    frozenset: _members("frozenset"),
    dict: _pairs("dict"),
    OrderedDict: _pairs("ordered"),
    deque: lambda value, writer: {"deque": [writer.parts(value), value.maxlen]},
    bytearray: lambda value, _: {"bytearray": [bytes(value)]},
    array: lambda value, _: {"numbers": [value.typecode, value.tobytes()]},
    complex: lambda value, _: {"complex": [value.real, value.imag]},
    random.Random: _of_random,
}
_UNSHARED: Final = frozenset({tuple, frozenset, complex})
SHARED: Final = frozenset(_WAYS) - _UNSHARED
"""Classes of containers that two places may hold the same one of."""
