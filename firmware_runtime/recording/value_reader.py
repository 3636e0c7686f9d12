"""Makes values of what a `Writer` has written: see `values`. Nothing of a file is run."""

import random
import re
import sys
from array import array
from collections import OrderedDict, deque
from collections.abc import Callable, Collection, Iterable
from enum import Enum
from typing import Any, Final

from firmware_runtime.recording.records import (
    UnknownValue,
    class_named,
    is_key,
    member_of,
    record_of,
)
from firmware_runtime.recording.value_writer import DEEPEST, GENERATORS, SHARED, Plain

MOST_AGAIN: Final = 1 << 20
"""Values in what is met again, added up: so many lists within lists are never gone through."""


class Reader:
    """Makes values of what one `Writer` has written.

    `known` gives an object by its number; `packages` are those whose records are made, by default
    all but Python's and the runtime's dependencies.
    """

    __slots__ = ("_again", "_depth", "_known", "_made", "_packages", "_values")

    def __init__(
        self,
        known: Callable[[int], object] | None = None,
        packages: Collection[str] | None = None,
    ) -> None:
        self._known = known
        self._packages = packages
        self._made: list[tuple[object, int]] = []
        """Objects that can be changed, and how many values are in each."""
        self._values = self._again = 0
        self._depth = 0

    def made(self, of: Plain) -> object:
        """The value that was written so. Raises UnknownValue."""
        self._values += 1
        if not isinstance(of, list | dict):
            return of
        if self._depth >= DEEPEST:
            raise UnknownValue(f"values within values, over {DEEPEST} deep")
        self._depth += 1
        try:
            if isinstance(of, list):
                return tuple([self.made(each) for each in of])
            return self._guarded(self._noted, of)
        finally:
            self._depth -= 1

    def content(self, of: Plain) -> object:
        """A container that holds what a known one did; it is not met again. Raises UnknownValue."""
        return self._guarded(lambda name, parts: _BUILTIN[name](parts, self), of)

    def keys(self, of: Iterable[Plain]) -> list[object]:
        """Values that can be keys. Raises UnknownValue."""
        found = [self.made(each) for each in of]
        for form, value in zip(of, found, strict=True):
            if not is_key(value) and not (isinstance(form, dict) and "known" in form):
                raise UnknownValue(f"{form!r:.80}: cannot be a key, or in a set")
        return found

    def _guarded(self, make: Callable[[str, list[Any]], object], of: Plain) -> object:
        """What is made of a form of one word. Raises UnknownValue."""
        try:
            ((name, parts),) = of.items()
            return make(name, parts)
        except UnknownValue:
            raise
        except Exception as error:  # whatever stands in a file
            raise UnknownValue(f"{of!r:.80}: {type(error).__name__}: {error}") from error

    def _noted(self, name: str, parts: list[object]) -> object:
        before = self._values
        value, is_shared = self._of(name, parts)
        if is_shared:
            self._made.append((value, self._values - before + 1))
        return value

    def _of(self, name: str, parts: list[Any]) -> tuple[object, bool]:
        """The value, and whether it may be met again."""
        if name == "known" and self._known is not None:
            return self._known(*parts), False
        if name == "same" and self._known is not None:
            return self._same(*parts), False
        if name in _BUILTIN:
            value = _BUILTIN[name](parts, self)
            is_shared = type(value) in SHARED
            return value, is_shared or name in _SHARED_OF_NUMPY
        return self._of_class(name, parts)

    def _same(self, place: object) -> object:
        if type(place) is not int or not 0 <= place < len(self._made):
            raise UnknownValue(f"{place!r:.40}: nothing has been made as that")
        value, values = self._made[place]
        self._values += values
        self._again += values
        if self._again > MOST_AGAIN:
            raise UnknownValue(f"over {MOST_AGAIN} values in what is met again")
        return value

    def _of_class(self, name: str, parts: list[object]) -> tuple[object, bool]:
        kind = class_named(name, self._packages)
        if issubclass(kind, Enum):
            (said,) = parts
            return member_of(kind, said), False
        record = record_of(kind)
        values = [self.made(each) for each in parts]
        if len(record.names) != len(values):
            fields = ", ".join(record.names)
            raise UnknownValue(f"{name}: {len(values)} fields; expected {fields}")
        return record.make(values), record.is_shared


def _array(parts: list[Any], _: Reader) -> Any:  # noqa: ANN401 -- numpy takes long to import
    numpy: Any = sys.modules.get("numpy")
    if numpy is None:
        raise UnknownValue("an array of numpy; expected a model that imports it")
    kind, shape, content = parts
    if _DTYPE.fullmatch(kind) is None:
        raise UnknownValue(f"an array of {kind!r:.40}; expected one of numbers")
    return numpy.frombuffer(content, numpy.dtype(kind)).reshape(shape).copy()


def _generator(parts: list[object], reader: Reader) -> object:
    name, state = parts
    generators: object = sys.modules.get("numpy.random")
    if generators is None or name not in GENERATORS:
        raise UnknownValue(f"{name!r:.40}; expected a generator of a numpy that is imported")
    found = getattr(generators, name)(0)
    found.state = reader.made(state)
    return found


def _random(parts: list[Any], _: Reader) -> random.Random:
    version, words, gauss = parts
    found = random.Random()  # noqa: S311 -- a model's, not a secret
    found.setstate((version, tuple(array("I", words)), gauss))
    return found


def _integer(parts: list[object], _: Reader) -> int:
    (digits,) = parts
    if not isinstance(digits, str):
        raise UnknownValue(f"{digits!r:.40}; expected digits")
    return int(digits)


def _numbers(parts: list[Any], _: Reader) -> "array[Any]":
    code, content = parts
    if not isinstance(content, bytes):
        raise UnknownValue("numbers without bytes")
    found = array(code)
    found.frombytes(content)
    return found


def _dictionary(parts: list[Any], reader: Reader) -> list[tuple[object, Any]]:
    found = []
    for key, each in parts:
        (first,) = reader.keys([key])
        found.append((first, reader.made(each)))
    return found


def _bytearray(parts: list[object], _: Reader) -> bytearray:
    (content,) = parts
    if not isinstance(content, bytes):
        raise UnknownValue("a bytearray without bytes")
    return bytearray(content)


_DTYPE: Final = re.compile(r"[<>|=][biufc]\d{1,2}")
_SHARED_OF_NUMPY: Final = frozenset({"array", "generator"})
_BUILTIN: Final[dict[str, Callable[[list[Any], Reader], object]]] = {
    "int": _integer,
    "complex": lambda parts, _: complex(*parts),
    "list": lambda parts, reader: [reader.made(each) for each in parts],
    "set": lambda parts, reader: set(reader.keys(parts)),
    "frozenset": lambda parts, reader: frozenset(reader.keys(parts)),
    "dict": lambda parts, reader: dict(_dictionary(parts, reader)),
    "ordered": lambda parts, reader: OrderedDict(_dictionary(parts, reader)),
    "deque": lambda parts, reader: deque([reader.made(each) for each in parts[0]], parts[1]),
    "bytearray": _bytearray,
    "numbers": _numbers,
    "array": _array,
    "scalar": lambda parts, reader: _array(parts, reader)[()],
    "random": _random,
    "generator": _generator,
}
