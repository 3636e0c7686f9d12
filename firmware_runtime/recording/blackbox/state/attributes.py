"""The attributes of objects, read without asking for their dictionaries.

Up to 3.12, CPython keeps attributes in the object itself until its dictionary is asked for; from
then on it reads and sets them more slowly, for as long as the object lives: TachoBot's recorded
step took a fifth longer (26 November 2026, CPython 3.11.7). So their names are found in the code of
the class, and it is counted whether these are all: the collector says how many objects one refers
to. Where they are not, the dictionary is asked for. From 3.13 on that costs nothing.
"""

import gc
import sys
import types
from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import Any, Final, TypeAlias

import msgspec

from firmware_runtime.recording.records import in_class

Attributes: TypeAlias = dict[str, Any]
Thing: TypeAlias = Any

_DICTIONARIES_ARE_FREE: Final = sys.version_info >= (3, 13)


def attributes_of(thing: Thing) -> Attributes:
    """The attributes of an object that has a dictionary, in the order of their names."""
    found = None if _DICTIONARIES_ARE_FREE else _without_dictionary(thing)
    return dict(sorted(vars(thing).items())) if found is None else found


def reader_of(thing: Thing) -> Callable[[], Attributes]:
    """Reads the attributes of one object, again and again, in no stated order."""
    if _DICTIONARIES_ARE_FREE:
        return lambda: thing.__dict__
    found = _without_dictionary(thing)
    if found is None:
        if _is_its_alone(thing):
            # a plain one is read in less time than an object's own
            object.__setattr__(thing, "__dict__", dict(vars(thing)))
        return lambda: thing.__dict__
    names, count, referents = tuple(found), len(gc.get_referents(thing)), gc.get_referents
    get, defaults = attrgetter(*_TWO, *names), _defaults(type(thing), names)

    def read() -> Attributes:
        try:
            values = get(thing)[2:]
            is_own = not any(values[place] is default for place, default in defaults)
            if is_own and len(referents(thing)) == count:
                return dict(zip(names, values, strict=True))
        except AttributeError:  # one has been deleted, and another set
            pass
        return attributes_of(thing)

    return read


def _is_its_alone(thing: Thing) -> bool:
    """Whether nothing but the object holds its dictionary; objects may share one (a Borg)."""
    return sys.getrefcount(vars(thing)) <= _OF_ITS_OWN and not isinstance(thing, msgspec.Struct)


_OF_ITS_OWN: Final = 2
"""References to a dictionary that is asked for how many it has: the object's, and the question."""


def _defaults(kind: type[Thing], names: tuple[str, ...]) -> list[tuple[int, object]]:
    """What the class has under some of these names, by their place."""
    found = ((place, in_class(kind, name, _NONE)) for place, name in enumerate(names))
    return [(place, value) for place, value in found if value is not _NONE]


_TWO: Final = ("__class__", "__class__")
"""Names that every object has: of one alone the getter would return no tuple."""


def _without_dictionary(thing: Thing) -> Attributes | None:
    """The attributes of an object; None where they cannot all be found."""
    kind = type(thing)
    names = _names_in(kind)  # type: ignore[arg-type]  # a class has a hash
    if names is None:
        return None
    found: Attributes = {}
    for name, of_class in names:
        value = getattr(thing, name, of_class)
        if value is not of_class:
            found[name] = value
    return found if len(found) + 1 == len(gc.get_referents(thing)) else None  # and its class


@cache
def _names_in(kind: type[Thing]) -> tuple[tuple[str, object], ...] | None:
    """Names that attributes of such an object may have, and what its class has under each.

    None for a class whose attributes are computed, or whose objects hold more than attributes.
    """
    written = written_classes(kind)
    if written is None or any(map(_is_more, written)):
        return None
    of_class: dict[str, object] = {}
    for each in reversed(kind.__mro__):
        of_class.update(vars(each))
    names = sorted(frozenset().union(*map(_names_of, written)))
    pairs = ((name, of_class.get(name, _NONE)) for name in names)
    return tuple((name, value) for name, value in pairs if not hasattr(type(value), "__get__"))


def written_classes(kind: type[Thing]) -> list[type] | None:
    """The classes that it is made of beside `object`; None if not all are written in Python."""
    written = [each for each in kind.__mro__ if each.__flags__ & _HEAP_TYPE]
    return written if len(written) + 1 == len(kind.__mro__) else None


def _is_more(kind: type[Thing]) -> bool:
    """Whether a class computes attributes, or has slots."""
    of_class = vars(kind)
    return (
        "__getattr__" in of_class
        or "__getattribute__" in of_class
        or any(isinstance(each, types.MemberDescriptorType) for each in of_class.values())
    )


_HEAP_TYPE: Final = 1 << 9
"""The bit of `type.__flags__` that classes written in Python have."""
_NONE: Final = object()


@cache
def _names_of(kind: type[Thing]) -> frozenset[str]:
    """Names in the code and the annotations of one class."""
    names = set(vars(kind).get("__annotations__", ()))
    for each in vars(kind).values():
        functions = (each.fget, each.fset) if isinstance(each, property) else (each,)
        for function in functions:
            code = getattr(getattr(function, "__func__", function), "__code__", None)
            if isinstance(code, types.CodeType):
                _add_names_in(code, names)
    return frozenset(names)


def _add_names_in(code: types.CodeType, names: set[str]) -> None:
    names.update(code.co_names)
    for each in code.co_consts:
        if isinstance(each, types.CodeType):
            _add_names_in(each, names)
