"""Makes objects of what stands in a file.

Of classes that the robot has, or that stand in modules imported already; without running any
function of those classes. An object is made before what it holds, which may lead back to it.
"""

import array
import itertools
import sys
import types
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from enum import Enum
from functools import partial
from pathlib import PosixPath, PurePosixPath
from typing import Any, Final

import msgspec

from firmware_runtime.blackbox.state.later import (
    MADE_EMPTY,
    MADE_WHOLE,
    Known,
    NoValue,
    Value,
    named,
)
from firmware_runtime.blackbox.state.layouts import Layout, Thing, by_name, layout_of
from firmware_runtime.recording.members import member_of
from firmware_runtime.recording.structs import empty_struct

_DEPTH: Final = 20_000
"""Calls within calls: a state takes some ten for each of the objects within objects that pickle,
which calls itself less often, could write; and stays within a stack of 8 MiB."""


@contextmanager
def deep_calls() -> Iterator[None]:
    """Within the block what was written as deep as it may be can be made, too."""
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(max(limit, _DEPTH))
    try:
        yield
    finally:
        sys.setrecursionlimit(limit)


class Making:
    """Makes objects of what stands in a file; what stood there twice is made once.

    Functions and classes, which the robot might call, are of `modules` only: those it is made of.
    """

    def __init__(self, known: Sequence[Thing], modules: Collection[str]) -> None:
        self._known = known
        self._modules = modules
        self._made: dict[int, Thing] = {}
        self._kept: list[object] = []
        """What has been read, so that no identity is given twice."""

    def of(self, read: Thing) -> Thing:
        """The object. Raises NoValue."""
        kind = type(read)
        if kind is Known:
            return self._known[read.number]
        if kind not in _COMPOUND:
            return read
        if id(read) in self._made:
            return self._made[id(read)]
        self._kept.append(read)
        made = self._of_value(read) if kind is Value else self._of_container(read)
        self._made[id(read)] = made
        return made

    def _of_container(self, read: Thing) -> Thing:
        if isinstance(read, bytearray):
            return bytearray(read)
        if isinstance(read, tuple | frozenset):
            return type(read)([self.of(each) for each in read])
        made = self._made[id(read)] = type(read)()
        if isinstance(read, dict):
            made.update((self.of(key), self.of(value)) for key, value in read.items())
        elif isinstance(read, list):
            made.extend(self.of(each) for each in read)
        else:
            made.update([self.of(each) for each in read])
        return made

    def _of_value(self, read: Value) -> Thing:
        try:
            if read.what == "object":
                return self._object(read)
            if read.what == "member":
                return self._member(read)
            if read.what in ("class", "function"):
                return self._of_name(*read.parts)
            if read.what in ("deque", "default", "ordered"):
                return self._container(read)
            return _MAKERS[read.what](*(self.of(each) for each in read.parts))
        except NoValue:
            raise
        except Exception as error:  # whatever stands in a file
            raise NoValue(f"{read.what}: {type(error).__name__}: {error}") from error

    def kind_of(self, read: Value) -> type[Thing]:
        """The class of what was read. Raises NoValue."""
        given = read.kind
        if isinstance(given, Value) and given.what == "class":
            kind = named(*given.parts)  # of any module: nothing can call it
        else:
            kind = self.of(given)
        if not isinstance(kind, type):
            raise NoValue(f"{kind!r:.80}; expected a class")
        return kind

    def _of_name(self, name: str) -> object:
        found = named(name)
        if isinstance(found, type) and found.__module__ == "builtins":
            return found
        if not isinstance(found, type | types.FunctionType | types.BuiltinFunctionType):
            raise NoValue(f"{name}: the robot has no such class or function")
        if name.partition(":")[0] not in self._modules:
            raise NoValue(f"{name}, which is in no module that the robot is made of")
        return found

    def _member(self, read: Value) -> object:
        kind = self.kind_of(read)
        if not issubclass(kind, Enum):
            raise NoValue(f"{kind.__qualname__}; expected an enumeration")
        (said,) = read.parts
        return member_of(kind, said)

    def _container(self, read: Value) -> Thing:
        """One of the module `collections`."""
        made: Thing
        if read.what == "deque":
            content, most = read.parts
            made = self._made[id(read)] = deque(maxlen=most)
            made.extend(self.of(content))
        elif read.what == "default":
            factory, content = read.parts
            made = self._made[id(read)] = defaultdict()
            made.default_factory = self.of(factory)
            made.update(self.of(content))
        else:
            made = self._made[id(read)] = OrderedDict()
            made.update(self.of(read.parts))
        return made

    def _object(self, read: Value) -> Thing:
        kind = self.kind_of(read)
        layout = layout_of(kind)
        base = layout.base
        content, slots, attributes = read.parts
        made: Thing
        if issubclass(kind, msgspec.Struct):
            made = self._made[id(read)] = empty_struct(kind)
        elif base in MADE_EMPTY:
            made = self._made[id(read)] = MADE_EMPTY[base](kind)
            if base is deque and isinstance(content, tuple):
                content, most = content
                deque.__init__(made, (), most)
            if layout.content is not None:
                layout.content.fill(made, self.of(content))
        elif base in MADE_WHOLE:
            made = self._made[id(read)] = base.__new__(kind, self.of(content))
        elif issubclass(base, BaseException):
            arguments = self.of(content)
            made = self._made[id(read)] = base.__new__(kind, *arguments)
            base.__init__(made, *arguments)  # of Python's own class: it has fields beside `args`
        else:
            raise NoValue(f"{kind.__qualname__}: made of a {base.__name__}")
        if layout.slots:
            set_slots(layout, made, by_name(layout, self.of(slots)))
        if layout.has_attributes:
            set_attributes(made, self.of(attributes))
        return made


_COMPOUND: Final = frozenset({Value, tuple, frozenset, list, dict, set, bytearray})


def set_slots(layout: Layout, thing: Thing, values: dict[str, Thing]) -> None:
    """Set the slots of an object to these, in place."""
    for name, slot in layout.slots:
        if name in values:
            slot.__set__(thing, values[name])
        elif name in layout.slots_of(thing):
            slot.__delete__(thing)


def set_attributes(thing: Thing, values: dict[str, Thing]) -> None:
    """Set the attributes of an object to these, in place."""
    present: dict[str, Thing] = thing.__dict__
    for name in [name for name in present if name not in values]:
        del present[name]
    present.update(values)


def _iterator(iterated: Thing, place: int) -> Thing:
    if type(iterated) not in (tuple, list, range):
        raise NoValue("an iterator over something else than a tuple, list or range")
    made = iter(iterated)
    made.__setstate__(place)
    return made


def _view(known: memoryview, begin: int, end: int, number_format: Any) -> memoryview:  # noqa: ANN401
    return known.cast("B")[begin:end].cast(number_format)


def _array(dtype: str, shape: tuple[int, ...], order: Any, numbers: bytes) -> Thing:  # noqa: ANN401
    numpy: Any = sys.modules.get("numpy")
    if numpy is None:
        raise NoValue("an array of numpy; expected a model that imports it")
    return numpy.frombuffer(numbers, numpy.dtype(dtype)).reshape(shape, order=order).copy(order)


def _part(  # a view of an array
    owner: Thing, begin: int, shape: Sequence[int], strides: Sequence[int], dtype: str
) -> Thing:
    numpy: Any = sys.modules["numpy"]
    memory = owner if owner.flags.c_contiguous else owner.T
    return numpy.ndarray(shape, numpy.dtype(dtype), memory, begin, strides)


def _method(owner: Thing, name: str) -> object:
    function = getattr(type(owner), name, None)
    if not isinstance(function, types.FunctionType):
        raise NoValue(f"{name}: {type(owner).__qualname__} has no such method")
    return types.MethodType(function, owner)


def _builtin(owner: Thing, name: str) -> object:
    method = vars(layout_of(type(owner)).base).get(name)
    if not isinstance(method, types.MethodDescriptorType | types.WrapperDescriptorType):
        raise NoValue(f"{name}: {type(owner).__qualname__} has no such method")
    return method.__get__(owner)


_MAKERS: Final[dict[str, Callable[..., object]]] = {
    "method": _method,
    "bound": types.MethodType,
    "builtin": _builtin,
    "partial": lambda func, args, keywords: partial(func, *args, **keywords),
    "numbers": array.array,
    "complex": complex,
    "path": PosixPath,
    "pure path": PurePosixPath,
    "range": range,
    "slice": slice,
    "singleton": lambda name: {"NotImplemented": NotImplemented, "Ellipsis": ...}[name],
    "count": itertools.count,
    "view": _view,
    "iterator": _iterator,
    "array": _array,
    "part": _part,
    "number": lambda dtype, number: _array(dtype, (), "C", number)[()],
}
