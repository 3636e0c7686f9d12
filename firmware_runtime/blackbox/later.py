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
from typing import Any, Final

from firmware_runtime.blackbox.layouts import (
    ITERATORS,
    Layout,
    Thing,
    is_number_of_numpy,
    layout_of,
)


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


def reduced(thing: Thing) -> tuple[Any, ...]:
    """What a pickler writes for an object: a Value. Raises NoValue."""
    way = _FOUND.get(type(thing))
    if way is None:
        way = _FOUND[type(thing)] = _way_of(type(thing))
    what, kind, parts = way(thing)
    return Value, (what, kind), parts


_Way = Callable[[Thing], tuple[str, object, object]]
_FOUND: Final[dict[type[Thing], _Way]] = {}


def _way_of(kind: type[Thing]) -> _Way:
    if issubclass(kind, type):
        return lambda thing: ("class", None, [_name_of(thing)])
    if issubclass(kind, Enum):
        return lambda thing: ("member", kind, [thing.name])
    if kind in _WAYS:
        return _WAYS[kind]
    if kind in ITERATORS:
        return _of_iterator
    if kind.__module__.partition(".")[0] == "numpy":
        return _of_numpy
    layout = layout_of(kind)
    is_made_here = layout.kind is not layout.base or issubclass(kind, BaseException)
    if not (layout.is_sound and is_made_here and _is_makeable(layout.base)):
        raise NoValue(f"a {kind.__module__}.{kind.__qualname__} made during the run")
    return partial(_of_object, layout)


def _is_makeable(base: type[Thing]) -> bool:
    return base in MADE_EMPTY or base in MADE_WHOLE or issubclass(base, BaseException)


def _of_object(layout: Layout, thing: Thing) -> tuple[str, object, object]:
    attributes = vars(thing) if layout.has_attributes else None
    slots = layout.slots_of(thing) if layout.slots else None
    return "object", layout.kind, (_content_of(layout, thing), slots, attributes)


def _content_of(layout: Layout, thing: Thing) -> object:
    base = layout.base
    if base is object:
        return None
    if issubclass(base, BaseException):
        return thing.args
    if base in MADE_WHOLE:
        return MADE_WHOLE[base](thing)
    return None if layout.content is None else layout.content.read(thing)


def _of_iterator(thing: Thing) -> tuple[str, object, object]:
    if type(thing) is types.GeneratorType:
        if thing.gi_frame is not None:
            raise NoValue(f"the generator {thing.__qualname__}, which is not through")
        return "iterator", None, [(), 0]
    if type(thing) is itertools.count:  # its text is the one way to read it in every Python
        first, _, step = repr(thing)[len("count(") : -1].partition(", ")
        return "count", None, [_number(first), _number(step or "1")]
    _, (iterated, *_), *place = thing.__reduce__()
    return "iterator", None, [iterated, place[0] if place else 0]


def _number(text: str) -> float:
    try:
        return int(text)
    except ValueError:
        try:
            return float(text)
        except ValueError:
            raise NoValue(f"an itertools.count at {text}") from None


def _of_method(thing: types.MethodType) -> tuple[str, object, object]:
    name = thing.__func__.__name__
    if getattr(type(thing.__self__), name, None) is thing.__func__:
        return "method", None, [thing.__self__, name]
    return "bound", None, [thing.__func__, thing.__self__]


def _of_builtin(thing: Any) -> tuple[str, object, object]:  # noqa: ANN401 -- of many classes
    owner = thing.__self__
    if owner is None or isinstance(owner, types.ModuleType):
        return "function", None, [_name_of(thing)]
    return "builtin", None, [owner, thing.__name__]


def _of_numpy(thing: Thing) -> tuple[str, object, object]:
    is_scalar = is_number_of_numpy(thing)
    if type(thing).__name__ != "ndarray" and not is_scalar:
        raise NoValue(f"a {type(thing).__module__}.{type(thing).__qualname__} made during the run")
    if thing.dtype.hasobject or thing.dtype.names is not None:
        raise NoValue(f"an array of {thing.dtype} made during the run")
    if is_scalar:
        return "number", None, [thing.dtype.str, thing.tobytes()]
    order = "F" if thing.flags.f_contiguous and not thing.flags.c_contiguous else "C"
    return "array", None, [thing.dtype.str, thing.shape, order, thing.tobytes(order)]


_WAYS: Final[dict[type[Any], _Way]] = {
    types.FunctionType: lambda thing: ("function", None, [_name_of(thing)]),
    types.MethodType: _of_method,
    types.BuiltinFunctionType: _of_builtin,
    partial: lambda thing: ("partial", None, [thing.func, thing.args, thing.keywords]),
    deque: lambda thing: ("deque", None, [list(thing), thing.maxlen]),
    defaultdict: lambda thing: ("default", None, [thing.default_factory, dict(thing)]),
    OrderedDict: lambda thing: ("ordered", None, list(thing.items())),
    array.array: lambda thing: ("numbers", None, [thing.typecode, thing.tobytes()]),
    complex: lambda thing: ("complex", None, [thing.real, thing.imag]),
    range: lambda thing: ("range", None, [thing.start, thing.stop, thing.step]),
    slice: lambda thing: ("slice", None, [thing.start, thing.stop, thing.step]),
    type(NotImplemented): lambda _: ("singleton", None, ["NotImplemented"]),
    type(Ellipsis): lambda _: ("singleton", None, ["Ellipsis"]),
}


def _name_of(thing: Any) -> str:  # noqa: ANN401 -- a class or function
    name = f"{thing.__module__}:{thing.__qualname__}"
    if named(name) is not thing:
        raise NoValue(f"{thing!r}, which no module holds by that name")
    return name


@cache
def named(name: str) -> object:
    """What stands under a name in a module that is imported already; None if nothing does."""
    module, _, path = name.partition(":")
    found: Any = sys.modules.get(module)
    for word in path.split("."):
        found = vars(found).get(word) if isinstance(found, types.ModuleType | type) else None
    return found
