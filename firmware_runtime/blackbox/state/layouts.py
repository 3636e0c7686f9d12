"""What an object consists of: the content of a built-in class, slots, attributes.

An object is one of four.

- An atom (number, text, module, None) is its own value.
- A constant cannot be changed from Python (a tuple, a bound method, a frozen dataclass, a class, a
  function but for its cells), though what it leads to can be. It has no state of its own.
- A passing value is an iterator: it cannot be set back, so another one is put in its place.
- Everything else has state. It is read and set without any function of the object's own class: the
  content by the built-in class that it derives from (`contents`), slots by their descriptors,
  attributes in its dictionary.

Attributes of classes and names of modules are state of the program, not of the robot.
"""

import functools
import gc
import itertools
import operator
import re
import struct
import sys
import types
import weakref
from collections.abc import Callable, Iterator
from enum import Enum
from pathlib import PosixPath, PurePosixPath
from typing import Any, Final, TypeAlias

import msgspec
from msgspec import Struct

from firmware_runtime.blackbox.state.attributes import attributes_of
from firmware_runtime.blackbox.state.contents import Content, content_of
from firmware_runtime.devs.errors import ModelError

Thing: TypeAlias = Any
"""Any object: it is looked at, not used."""


class UnkeepableState(ModelError, TypeError):
    """Something within a robot that cannot be kept in a file and set back."""

    def __init__(self, path: str, fault: str) -> None:
        self.path = path
        super().__init__(f"{path}: {fault}")


ATOMS: Final = frozenset(
    {
        *(type(None), bool, int, float, complex, str, bytes, range),
        *(types.CodeType, type(NotImplemented), type(Ellipsis)),
        *(PosixPath, PurePosixPath),  # their slots keep what hash() said in this process
    }
)
ITERATORS: Final = frozenset(
    {
        *(itertools.count, types.GeneratorType),
        *(type(iter(())), type(iter([])), type(iter(range(0))), type(iter(range(1 << 70)))),
    }
)
"""Those of which Python says where they are, be it only that they are through."""
_CONSTANTS: Final = frozenset(
    {
        *(tuple, frozenset, slice, property, staticmethod, classmethod),
        *(types.ModuleType, types.FunctionType),
        *(types.MethodType, types.BuiltinFunctionType, types.MethodWrapperType),
        *(types.WrapperDescriptorType, types.MethodDescriptorType),
        *(types.ClassMethodDescriptorType, types.GetSetDescriptorType),
        *(types.MemberDescriptorType, types.MappingProxyType),
        *(types.GenericAlias, types.UnionType),
        *(re.Pattern, struct.Struct, weakref.ref),
        *(operator.attrgetter, operator.itemgetter, operator.methodcaller),
        *(functools.partial, type(functools.lru_cache(len))),
    }
)
_CONSTANTS_ELSEWHERE: Final = frozenset(
    {
        *(("numpy", name) for name in ("dtype", "ufunc")),
        *(("numpy.random._generator", name) for name in ("Generator",)),
        *(("msgspec.json", name) for name in ("Encoder", "Decoder")),
        *(("msgspec.msgpack", name) for name in ("Encoder", "Decoder")),
        *(("datetime", name) for name in ("date", "datetime", "time", "timedelta", "timezone")),
        ("decimal", "Decimal"),
    }
)
_HEAP_TYPE: Final = 1 << 9
"""The bit of `type.__flags__` that classes written in Python have (and some written in C)."""
_MADE_IN_C: Final = 1 << 8 | 1 << 7
"""Bits that none written in Python has: immutable, not to be instantiated."""
_POINTER: Final = struct.calcsize("P")


class Layout(Struct, frozen=True):
    """How objects of one class are read: `base` is the built-in class underneath.

    `content` reads and sets what that holds; None where it holds nothing, or nothing that changes.
    """

    kind: type[Thing]
    base: type[Thing]
    content: Content | None
    slots: tuple[tuple[str, Thing], ...]
    """Names and descriptors."""
    has_attributes: bool
    is_constant: bool
    is_sound: bool
    """Whether all that such an object holds can be read."""

    @property
    def name(self) -> str:
        """Module and name of the class."""
        return f"{self.kind.__module__}.{self.kind.__qualname__}"

    def slots_of(self, thing: Thing) -> dict[str, object]:
        """Its slots that are set, by name."""
        found: dict[str, object] = {}
        for name, slot in self.slots:
            try:
                found[name] = slot.__get__(thing)
            except AttributeError:  # not set
                continue
        return found


def layout_of(kind: type[Thing]) -> Layout:
    """The layout of a class."""
    found = _LAYOUTS.get(kind)
    if found is None:
        found = _LAYOUTS[kind] = _layout_of(kind)
    return found


_LAYOUTS: Final[dict[type[Thing], Layout]] = {}


def _layout_of(kind: type[Thing]) -> Layout:
    base = _base_of(kind)
    written = kind.__mro__[: kind.__mro__.index(base)]  # in Python, on top of the built-in one
    slots = tuple(
        (name, slot)
        for each in written
        for name, slot in vars(each).items()
        if isinstance(slot, types.MemberDescriptorType)
    )
    content = content_of(base)
    is_constant = _is_constant(kind, base, slots)
    is_plain = base in ATOMS or base in (object, tuple, frozenset, memoryview)
    is_error = issubclass(base, BaseException)  # has notes as an attribute, whatever its class
    is_sound = is_constant or is_plain or content is not None or is_error
    has_attributes = bool(kind.__dictoffset__) and (bool(written) or is_error)
    return Layout(kind, base, content, slots, has_attributes, is_constant, is_sound)


def _base_of(kind: type[Thing]) -> type[Thing]:
    """The first class that is not written in Python; the fields of a Struct are slots like any."""
    base = next(each for each in kind.__mro__ if not _is_written_in_python(each))
    return object if issubclass(kind, msgspec.Struct) else base


def _is_written_in_python(kind: type[Thing]) -> bool:
    """Whether its objects have room for slots, attributes and references, and for nothing else."""
    if not kind.__flags__ & _HEAP_TYPE or kind.__flags__ & _MADE_IN_C or kind.__base__ is None:
        return False
    names = vars(kind)
    new = names.get("__new__")
    slots = sum(isinstance(each, types.MemberDescriptorType) for each in names.values())
    room = slots + ("__weakref__" in names) + ("__dict__" in names)
    size = kind.__basicsize__ - kind.__base__.__basicsize__
    return size <= _POINTER * room and not isinstance(new, types.BuiltinFunctionType)


def _is_constant(kind: type[Thing], base: type[Thing], slots: tuple[Thing, ...]) -> bool:
    if issubclass(kind, type | Enum) or (base in _CONSTANTS and base not in (tuple, frozenset)):
        return True
    if (base.__module__, base.__name__) in _CONSTANTS_ELSEWHERE:
        return True
    if base in (tuple, frozenset) or base in ATOMS:
        return kind.__dictoffset__ == 0 and not slots
    parameters = vars(kind).get("__dataclass_params__")
    settings = getattr(kind, "__struct_config__", None)
    return getattr(parameters, "frozen", False) or getattr(settings, "frozen", False)


def parts_of(thing: Thing) -> Iterator[tuple[str, object]]:
    """What an object leads to, and by which step of a path. Sets are left out: see `known`."""
    kind = type(thing)
    layout = layout_of(kind)
    if isinstance(thing, _WITHOUT_PARTS):
        return
    if kind is types.FunctionType:
        yield from _of_function(thing)
    elif kind in ITERATORS:
        yield from _of_iterator(thing)
    elif layout.base is not object:
        yield from _of_base(thing, layout.base)
    if layout.slots:
        for name, value in layout.slots_of(thing).items():
            yield f".{name}", value
    if layout.has_attributes:
        for name, value in attributes_of(thing).items():
            yield f".{name}", value


def _of_function(function: types.FunctionType) -> Iterator[tuple[str, object]]:
    names = function.__code__.co_freevars
    for name, cell in zip(names, function.__closure__ or (), strict=True):
        yield f".<{name}>", cell
    for value in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()):
        yield ".<default>", value
    if vars(function):
        yield ".__dict__", vars(function)


def _of_iterator(iterator: Thing) -> Iterator[tuple[str, object]]:
    if type(iterator) not in (itertools.count, types.GeneratorType):
        _, (iterated, *_), *_ = iterator.__reduce__()
        yield "[...]", iterated


def _of_base(thing: Thing, base: type[Thing]) -> Iterator[tuple[str, object]]:
    if issubclass(base, dict):
        for number, (key, value) in enumerate(dict.items(thing)):
            is_plain = type(key) in (str, int, bytes, bool, type(None))
            yield f".<key {number}>", key
            yield f"[{key!r}]" if is_plain else f".<value {number}>", value
        if base is not dict:
            yield ".default_factory", getattr(thing, "default_factory", None)
    elif base in _SEQUENCES or base.__name__ == "deque":
        yield from ((f"[{place}]", each) for place, each in enumerate(base.__iter__(thing)))
    elif base is types.CellType:
        try:
            yield "", thing.cell_contents
        except ValueError:  # not filled yet
            return
    elif issubclass(base, BaseException):
        yield ".args", thing.args
    elif (base.__module__, base.__name__) == ("numpy.random._generator", "Generator"):
        yield ".bit_generator", thing.bit_generator
    elif base in _CONSTANTS and base is not frozenset:
        yield from (("", each) for each in gc.get_referents(thing))


_SEQUENCES: Final = (list, tuple)
_WITHOUT_PARTS: Final = (type, Enum, types.ModuleType)


def is_number_of_numpy(thing: Thing) -> bool:
    """Whether it is one of numpy's scalars: a value, like a float."""
    numpy: Any = sys.modules.get("numpy")
    return numpy is not None and isinstance(thing, numpy.generic)


Getter: TypeAlias = Callable[[Thing], Thing]


def slots_getter(layout: Layout) -> Getter:
    """Reads all slots of an object into a tuple. Raises AttributeError for one that is unset."""
    names = [name for name, _ in layout.slots]
    if len(names) > 1 and all(getattr(layout.kind, name) is slot for name, slot in layout.slots):
        return operator.attrgetter(*names)
    return lambda thing: tuple(slot.__get__(thing) for _, slot in layout.slots)


def slots_or_names(get: Getter, thing: Thing, layout: Layout) -> Thing:
    """A tuple of all slots; those that are set by name, where one is not."""
    try:
        return get(thing)
    except AttributeError:
        return layout.slots_of(thing)


def by_name(layout: Layout, values: Thing) -> dict[str, Thing]:
    """The slots by name, of what one of these has read."""
    if isinstance(values, dict):
        return values
    return {name: value for (name, _), value in zip(layout.slots, values, strict=True)}
