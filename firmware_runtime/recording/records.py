"""Records: objects that hold fields and nothing else, and members of enumerations.

A named tuple, a `msgspec.Struct` or a dataclass whose objects can be taken apart and made again
without one function of their class: no `__del__`, no computed field, no class of a class of its
own. Everything else is no record, whatever a file says of it.
"""

import sys
import types
from abc import ABCMeta
from collections.abc import Callable, Collection, Sequence
from enum import Enum, EnumMeta, Flag
from functools import cached_property
from operator import attrgetter
from typing import Any, Final, TypeAlias

import msgspec

Kind: TypeAlias = type[Any]
Values: TypeAlias = Sequence[object]

EXPECTED: Final = (
    "expected a number, text, tuple, list, dict, enumeration, named tuple or dataclass"
)
_STRUCT_META: Final = type(msgspec.Struct)
_METACLASSES: Final = frozenset({type, ABCMeta, _STRUCT_META})
_TUPLE_ORDERED: Final = ("__hash__", "__eq__")
_ENUM_ORDERED: Final = (*_TUPLE_ORDERED, "__getattribute__")
_CLASS: Final[Any] = vars(object)["__class__"]
_DEPENDENCIES: Final = frozenset({"msgspec", "numpy", "pytest", "_pytest", "scipy"})
"""Packages that hold no model, in an environment that robots run in."""


class UnknownValue(ValueError):
    """A value that cannot be recorded, or not be made of a recording."""


class Record:
    """Codec of the objects of one class: `values_of` takes them apart, `make` makes them.

    `is_shared`: two places may hold the same one, and see each other's changes.
    """

    __slots__ = ("is_shared", "kind", "make", "name", "names", "values_of")

    def __init__(
        self,
        kind: Kind,
        names: tuple[str, ...],
        values_of: Callable[[object], Values],
        make: Callable[[Values], object],
        *,
        is_shared: bool,
    ) -> None:
        self.kind, self.name, self.names = kind, name_of(kind), names
        self.values_of, self.make, self.is_shared = values_of, make, is_shared


def record_of(kind: Kind) -> Record:
    """The record that a class is. Raises UnknownValue."""
    if kind not in _RECORDS:
        _RECORDS[kind] = _found(kind)
    found = _RECORDS[kind]
    if found is None:
        raise UnknownValue(f"{name_of(kind)} cannot be recorded; {EXPECTED}")
    return found


_RECORDS: Final[dict[Kind, Record | None]] = {}


def is_record(kind: Kind) -> bool:
    """Return whether objects of a class hold fields and nothing else."""
    try:
        record_of(kind)
    except UnknownValue:
        return False
    return True


def name_of(kind: Kind) -> str:
    """Module and name of a class, as a recording has it."""
    return f"{kind.__module__}:{kind.__qualname__}"


def class_named(name: str, packages: Collection[str] | None = None) -> Kind:
    """A record or enumeration of a module that is there already. Raises UnknownValue.

    It must be defined in that module, which must be of one of these packages, or at least neither
    of Python itself nor of what the runtime depends on.
    """
    module, _, path = name.partition(":")
    package = module.partition(".")[0]
    is_own = package not in _DEPENDENCIES and (packages is None or package in packages)
    found: object = (
        sys.modules.get(module) if is_own and package not in sys.stdlib_module_names else None
    )
    inner = dict(vars(found)) if type(found) is types.ModuleType else {}
    for word in path.split("."):
        found = inner.get(word)
        inner = dict(vars(found)) if isinstance(found, type) else {}
    if not isinstance(found, type) or name_of(found) != name or not _is_value_class(found):
        raise UnknownValue(f"{name}: the model has no such class")
    return found


def fields_of(kind: type[object]) -> tuple[str, ...]:
    """The names of a record's fields, in order; none of a class that is no record."""
    stated = ("__dataclass_fields__", "__struct_fields__", "_fields")
    return next((tuple(getattr(kind, each)) for each in stated if hasattr(kind, each)), ())


def slots_of(kind: Kind) -> dict[str, Any]:
    """Descriptors of the slots of a class, by name; the fields of a Struct are slots."""
    return {
        name: slot
        for each in kind.__mro__[::-1]
        for name, slot in vars(each).items()
        if isinstance(slot, types.MemberDescriptorType)
    }


def in_class(kind: Kind, name: str, otherwise: object = None) -> object:
    """Find a name in a class, or one that it derives from; no function of it is called."""
    return next((vars(each)[name] for each in kind.__mro__ if name in vars(each)), otherwise)


def written_member(member: Enum) -> object:
    """Return the name of a member; several members of a Flag together have no name."""
    return member.name if member.name in type(member).__members__ else member.value


def member_of(kind: type[Enum], written: object) -> Enum:
    """The member that was written so. Raises UnknownValue."""
    if isinstance(written, str) and written in kind.__members__:
        return kind.__members__[written]
    is_flag = issubclass(kind, Flag) and not _defines(kind, ("_missing_",))
    if is_flag and type(written) is int and getattr(kind, "_member_type_", None) in (int, object):
        return kind(written)
    raise UnknownValue(f"{name_of(kind)} has no member {written!r:.40}")


def is_key(value: object) -> bool:
    """Return whether a value can be a key, or stand in a set, without a function of its class."""
    kind = type(value)
    if kind in _PLAIN_KEYS:
        return True
    if issubclass(kind, Enum):
        return not _defines(kind, _ENUM_ORDERED)
    is_plain = issubclass(kind, tuple) and not _defines(kind, _TUPLE_ORDERED)
    return is_plain and all(map(is_key, tuple.__iter__(value)))  # type: ignore[arg-type]


_PLAIN_KEYS: Final = frozenset({type(None), bool, int, float, complex, str, bytes, frozenset})

# -------------------------------------------------------------------------------------------------


def _is_value_class(kind: Kind) -> bool:
    return is_record(kind) or (type(kind) is EnumMeta and issubclass(kind, Enum))


def _found(kind: Kind) -> Record | None:
    if type(kind) not in _METACLASSES or any("__del__" in vars(each) for each in kind.__mro__):
        return None
    if issubclass(kind, tuple):
        return _named_tuple(kind)
    if issubclass(kind, msgspec.Struct):
        return _struct(kind)
    return _dataclass(kind) if in_class(kind, "__new__") is object.__new__ else None


def _named_tuple(kind: Kind) -> Record | None:
    names = getattr(kind, "_fields", None)
    if not isinstance(names, tuple) or not all(isinstance(each, str) for each in names):
        return None
    if kind.__dictoffset__ or _defines(kind, ("__iter__", "__len__", "__getitem__")):
        return None

    def values_of(value: Any) -> Values:  # noqa: ANN401 -- of that class
        return [*tuple.__iter__(value)]

    return Record(
        kind, names, values_of, lambda values: tuple.__new__(kind, values), is_shared=False
    )


def _struct(kind: Kind) -> Record | None:
    written = [each for each in kind.__mro__ if issubclass(each, msgspec.Struct)]
    own = [vars(each) for each in written if each is not msgspec.Struct]
    refused = ("__init__", "__new__", "__init_subclass__")
    if kind.__dictoffset__ or any(name in each for each in own for name in refused):
        return None
    names = kind.__struct_fields__
    slots = [_slot(kind, name) for name in names]
    if not all(slots):
        return None
    plain = kind
    if hasattr(kind, "__post_init__"):
        like_it: Any = _STRUCT_META
        plain = like_it(kind.__name__, (kind,), {"__post_init__": _nothing})

    def make(values: Values) -> object:
        made = plain(**dict.fromkeys(names))
        if plain is not kind:
            _CLASS.__set__(made, kind)  # a frozen one lets nothing be set by its own functions
        for slot, value in zip(slots, values, strict=True):
            slot.__set__(made, value)
        return made

    is_shared = not kind.__struct_config__.frozen
    return Record(kind, names, _getter(kind, names), make, is_shared=is_shared)


def _dataclass(kind: Kind) -> Record | None:
    dataclasses: Any = sys.modules.get("dataclasses")  # not every robot has some
    if dataclasses is None or not dataclasses.is_dataclass(kind):
        return None
    names = tuple(each.name for each in dataclasses.fields(kind))
    if _defines(kind, ("__getattribute__",)) or not _has_own_dictionary(kind):
        return None
    if slots_of(kind).keys() - names:
        return None
    for name in names:
        if _slot(kind, name) is None and _is_computed(kind, name):
            return None

    def make(values: Values) -> object:
        made = object.__new__(kind)
        for name, value in zip(names, values, strict=True):
            object.__setattr__(made, name, value)
        return made

    is_shared = not kind.__dataclass_params__.frozen
    return Record(kind, names, _getter(kind, names), make, is_shared=is_shared)


def _has_own_dictionary(kind: Kind) -> bool:
    """Return whether no class of it says otherwise where attributes are."""
    said = (vars(each).get("__dict__") for each in kind.__mro__)
    return all(each is None or isinstance(each, types.GetSetDescriptorType) for each in said)


def _getter(kind: Kind, names: tuple[str, ...]) -> Callable[[object], Values]:
    """Read the fields. Raises UnknownValue for an object with more attributes than these."""
    get = attrgetter(*names) if len(names) > 1 else None
    fields = frozenset(names) | _derived(kind)

    def values_of(value: object) -> Values:
        return get(value) if get else [getattr(value, each) for each in names]

    def values_of_checked(value: object) -> Values:
        if others := vars(value).keys() - fields:
            raise UnknownValue(f"{name_of(kind)} holds {min(others)}, which is no field of it")
        return values_of(value)

    return values_of_checked if kind.__dictoffset__ else values_of


def _derived(kind: Kind) -> frozenset[str]:
    """Attributes that are found again from the fields."""
    each = (item for one in kind.__mro__ for item in vars(one).items())
    return frozenset(name for name, value in each if isinstance(value, cached_property))


def _slot(kind: Kind, name: str) -> Any:  # noqa: ANN401 -- a descriptor
    """The slot that holds a field; None where an attribute does."""
    found = in_class(kind, name)
    return found if isinstance(found, types.MemberDescriptorType) else None


def _is_computed(kind: Kind, name: str) -> bool:
    """Return whether reading or setting that attribute runs something, or it has no place."""
    found = type(in_class(kind, name))
    return not kind.__dictoffset__ or hasattr(found, "__set__") or hasattr(found, "__delete__")


def _defines(kind: Kind, names: Collection[str]) -> bool:
    """Return whether a class, or a base of it outside Python itself, defines one of these."""
    own = (each for each in kind.__mro__ if each.__module__.partition(".")[0] not in _PYTHON)
    return any(name in vars(each) for each in own for name in names)


_PYTHON: Final = frozenset({"builtins", "enum", "typing", "abc"})


def _nothing(_: object) -> None:
    """In place of a model's own `__post_init__`."""
