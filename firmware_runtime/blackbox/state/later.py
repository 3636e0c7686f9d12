"""Objects that were made after the robot was built: kept by value.

In a file they are `Value`s, which name a class and hold parts, and nothing else: reading one runs
nothing (`making` makes objects of them). Generators are kept once they are through: an iterator
without items is put in their place.
"""

import array
import itertools
import sys
import types
from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable
from enum import Enum
from functools import cache, partial
from pathlib import PosixPath, PurePosixPath
from typing import Any, Final

from firmware_runtime.blackbox.state.layouts import (
    ITERATORS,
    Layout,
    Thing,
    is_number_of_numpy,
    layout_of,
    slots_getter,
    slots_or_names,
)
from firmware_runtime.recording.members import written_member


class Known:
    """In place of an object that the robot has had from the start."""

    __slots__ = ("number",)

    def __init__(self, number: int) -> None:
        self.number = number

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Known) and other.number == self.number

    def __hash__(self) -> int:
        return hash(("known", self.number))


class Value:
    """In place of an object made later: what it is, of which class, and its parts."""

    __slots__ = ("kind", "parts", "what")

    def __init__(self, what: str, kind: object = None) -> None:
        self.what = what
        self.kind = kind
        self.parts: Thing = None

    def __setstate__(self, parts: object) -> None:
        self.parts = parts

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Value) and _all_of(other) == _all_of(self)

    def __hash__(self) -> int:
        return hash((self.what, self.kind))


def _all_of(value: Value) -> tuple[object, ...]:
    return value.what, value.kind, value.parts


class NoValue(ValueError):
    """An object that has no value in a file, or a value that no object can be made of."""


MADE_EMPTY: Final[dict[type[Any], Callable[[Any], Any]]] = {
    each: each.__new__ for each in (object, list, dict, set, deque, bytearray, OrderedDict)
}
"""Built-in classes underneath of which an object can be made before its content is."""
MADE_WHOLE: Final[dict[type[Any], Callable[[Any], Any]]] = {
    int: int.__int__,
    float: float.__float__,
    str: str.__str__,
    bytes: lambda thing: bytes.join(b"", [thing]),
    tuple: lambda thing: tuple(tuple.__iter__(thing)),
    frozenset: lambda thing: list(frozenset.__iter__(thing)),
}
"""Those whose content cannot be set; each with what reads it."""


_Way = Callable[[Thing], tuple[Any, ...]]


def reduced(thing: Thing) -> tuple[Any, ...]:
    """What a pickler writes for an object: Value, its two arguments, its parts. Raises NoValue."""
    kind = type(thing)
    way = WAYS.get(kind)
    if way is None:
        way = WAYS[kind] = _way_of(kind)
    return way(thing)


def _way_of(kind: type[Thing]) -> _Way:
    if issubclass(kind, type):
        return lambda thing: _value("class", [_name_of(thing)])
    if issubclass(kind, Enum):
        arguments = "member", kind
        return lambda thing: (Value, arguments, [written_member(thing)])
    if kind in ITERATORS:
        return _of_iterator
    if kind.__module__.partition(".")[0] == "numpy":
        return _of_numpy
    layout = layout_of(kind)
    is_made_here = layout.kind is not layout.base or issubclass(kind, BaseException)
    if not (layout.is_sound and is_made_here and _is_makeable(layout.base)):
        raise NoValue(f"a {kind.__module__}.{kind.__qualname__} made during the run")
    return _way_of_layout(layout)


def _value(what: str, parts: object) -> tuple[Any, ...]:
    return Value, (what, None), parts


def _way_of_layout(layout: Layout) -> _Way:
    """For objects of one layout: content, slots (in order; by name if one is unset), attributes."""
    arguments = "object", layout.kind
    read = _reading(layout)
    get = slots_getter(layout) if layout.slots else None
    if get is None and not layout.has_attributes:
        return lambda thing: (Value, arguments, (read(thing), None, None))

    def way(thing: Thing) -> tuple[Any, ...]:
        slots = None if get is None else slots_or_names(get, thing, layout)
        attributes = thing.__dict__ if layout.has_attributes else None
        return Value, arguments, (read(thing), slots, attributes)

    return way


def _is_makeable(base: type[Thing]) -> bool:
    return base in MADE_EMPTY or base in MADE_WHOLE or issubclass(base, BaseException)


def _reading(layout: Layout) -> Callable[[Thing], object]:
    """What reads the content of objects of a layout."""
    if layout.base in MADE_WHOLE:
        return MADE_WHOLE[layout.base]
    if issubclass(layout.base, OSError):
        return lambda thing: OSError.__reduce__(thing)[1]  # `args` has no name of a file
    if issubclass(layout.base, BaseException):
        return _arguments
    if layout.base is deque:
        return lambda thing: [*thing] if thing.maxlen is None else ([*thing], thing.maxlen)
    return _nothing if layout.content is None else layout.content.read


def _arguments(error: Thing) -> object:
    """What an error is made of. Raises NoValue for one that says more than that."""
    if isinstance(error, ImportError | AttributeError | NameError) and error.name is not None:
        raise NoValue(f"a {type(error).__qualname__} made during the run")
    return error.args


def _nothing(_: Thing) -> None:
    return None


def _of_iterator(thing: Thing) -> tuple[Any, ...]:
    if type(thing) is types.GeneratorType:
        if thing.gi_frame is not None:
            raise NoValue(f"the generator {thing.__qualname__}, which is not through")
        return _value("iterator", [(), 0])
    if type(thing) is itertools.count:  # its text is the one way to read it in every Python
        first, _, step = repr(thing)[len("count(") : -1].partition(", ")
        return _value("count", [_number(first), _number(step or "1")])
    _, (iterated, *_), *place = thing.__reduce__()
    return _value("iterator", [iterated, place[0] if place else 0])


def _number(text: str) -> float:
    try:
        return int(text)
    except ValueError:
        try:
            return float(text)
        except ValueError:
            raise NoValue(f"an itertools.count at {text}") from None


def _of_method(thing: types.MethodType) -> tuple[Any, ...]:
    name = thing.__func__.__name__
    if getattr(type(thing.__self__), name, None) is thing.__func__:
        return _value("method", [thing.__self__, name])
    return _value("bound", [thing.__func__, thing.__self__])


def _of_builtin(thing: Any) -> tuple[Any, ...]:  # noqa: ANN401 -- of many classes
    owner = thing.__self__
    if owner is None or isinstance(owner, types.ModuleType):
        return _value("function", [_name_of(thing)])
    return _value("builtin", [owner, thing.__name__])


def _of_numpy(thing: Thing) -> tuple[Any, ...]:
    is_scalar = is_number_of_numpy(thing)
    if type(thing).__name__ != "ndarray" and not is_scalar:
        raise NoValue(f"a {type(thing).__module__}.{type(thing).__qualname__} made during the run")
    if thing.dtype.hasobject or thing.dtype.names is not None:
        raise NoValue(f"an array of {thing.dtype} made during the run")
    if is_scalar:
        return _value("number", [thing.dtype.str, thing.tobytes()])
    if thing.base is not None and _has_other_holders(thing):
        return _value("part", _place_in_owner(thing, thing.base))
    order = "F" if thing.flags.f_contiguous and not thing.flags.c_contiguous else "C"
    return _value("array", [thing.dtype.str, thing.shape, order, thing.tobytes(order)])


def _has_other_holders(array: Thing) -> bool:
    """Whether anything else holds the memory that an array is a view of."""
    if isinstance(array.base, memoryview):
        return not array.base.readonly
    return _holders(array) > _sole_holders()


@cache
def _sole_holders() -> int:
    """How many are counted where a view alone holds its memory."""
    numpy: Any = sys.modules["numpy"]
    return _holders(numpy.zeros(2)[1:])


def _holders(array: Thing) -> int:
    owner = array.base
    return sys.getrefcount(owner)


def _place_in_owner(array: Thing, owner: Thing) -> list[Thing]:
    """The array that owns the memory, and where in it a view begins, its shape, strides, type."""
    if type(owner).__name__ != "ndarray" or not owner.flags.forc:
        raise NoValue(f"an array over memory of a {type(owner).__qualname__} made during the run")
    begins = (each.__array_interface__["data"][0] for each in (array, owner))
    at, first = begins
    return [owner, at - first, array.shape, array.strides, array.dtype.str]


_COMPLEX: Final = ("complex", None)
WAYS: Final[dict[type[Any], _Way]] = {
    complex: lambda thing: (Value, _COMPLEX, (thing.real, thing.imag)),  # there may be hundreds
    types.FunctionType: lambda thing: _value("function", [_name_of(thing)]),
    types.MethodType: _of_method,
    types.BuiltinFunctionType: _of_builtin,
    partial: lambda thing: _value("partial", [thing.func, thing.args, thing.keywords]),
    deque: lambda thing: _value("deque", [list(thing), thing.maxlen]),
    defaultdict: lambda thing: _value("default", [thing.default_factory, dict(thing)]),
    OrderedDict: lambda thing: _value("ordered", list(thing.items())),
    array.array: lambda thing: _value("numbers", [thing.typecode, thing.tobytes()]),
    PosixPath: lambda thing: _value("path", [str(thing)]),
    PurePosixPath: lambda thing: _value("pure path", [str(thing)]),
    range: lambda thing: _value("range", [thing.start, thing.stop, thing.step]),
    slice: lambda thing: _value("slice", [thing.start, thing.stop, thing.step]),
    type(NotImplemented): lambda _: _value("singleton", ["NotImplemented"]),
    type(Ellipsis): lambda _: _value("singleton", ["Ellipsis"]),
}
"""What `reduced` does, by class; grows by the classes that it meets."""


def _name_of(thing: Any) -> str:  # noqa: ANN401 -- a class or function
    name = f"{thing.__module__}:{thing.__qualname__}"
    if named(name) is not thing:
        raise NoValue(f"{thing!r}, which no module holds by that name")
    return name


def named(name: str) -> object:
    """What stands under a name in a module that is imported already; None if nothing does."""
    module, _, path = name.partition(":")
    found: Any = sys.modules.get(module)
    for word in path.split("."):
        found = vars(found).get(word) if isinstance(found, types.ModuleType | type) else None
    return found
