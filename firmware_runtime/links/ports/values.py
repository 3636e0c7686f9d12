"""Values as datagrams bear them: read back from the form in which a trace shows them.

    port's type                            in the datagram
    bool, int, float, str                  true, 1, 1.5, "text"; a float may be written 1
    an enumeration                         the name of its member
    a named tuple, dataclass or struct     an object with its fields and no others; one that has a
                                           default of its own may be left out

and as a field's type, since a port's is a class:

    tuple[float, float], tuple[int, ...]   an array, as is list[float]
    dict[str, int]                         an object
    int | None                             null, or the value
    int | str, Wind | list[Wind]           the first of them, as declared, that it is a value of
    Literal["up", "down"]                  one of these

Everything is read by the declared types, down to the last field, so a model never finds a text
where it expects a number. A type that leaves open what is in it (`tuple`, `object`) is not read at
all. JSON has no numbers that are not finite; one too large for a float, or a whole one for 64 bits,
is refused.
"""

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from enum import Enum
from types import GenericAlias, NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    TypeAlias,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec import Meta, Raw

from firmware_runtime.links.ports.datagrams import Refusal

Read: TypeAlias = Callable[[bytes | msgspec.Raw], object]
"""Makes a value of JSON; raises Refusal, with what is wrong."""

_Make: TypeAlias = Callable[[Any], Any]
_Form: TypeAlias = tuple[Any, _Make]
"""A type as msgspec reads it, and how a value of the port's type is made of what it read."""

_PLAIN = {
    bool: bool,
    int: Annotated[int, Meta(ge=-(1 << 63), le=(1 << 63) - 1)],
    float: float,
    str: str,
}


def reader_of(port_type: type[object]) -> Read | None:
    """How values of a type are read; None if it does not say what they are made of."""
    try:
        form, make = _form(port_type)
    except (TypeError, NameError, RecursionError):  # nor do hints that lead nowhere say it
        return None
    decode = msgspec.json.Decoder(form).decode

    def read(json: bytes | msgspec.Raw) -> object:
        try:
            return make(decode(json))
        except Exception as error:  # what is malformed, and what a board's own class does not take
            raise Refusal(str(error) or type(error).__name__) from error

    return read


def _form(kind: Any) -> _Form:  # noqa: ANN401 -- a type hint
    """Raises TypeError for what cannot be read."""
    if kind in _PLAIN:
        return _PLAIN[kind], _same
    origin, parts = get_origin(kind), get_args(kind)
    if origin in _GENERIC and parts:
        return _GENERIC[origin](parts)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return Literal[tuple(kind.__members__)], kind.__getitem__
    if isinstance(kind, type) and has_fields(kind):
        return _record_form(kind)
    raise TypeError(f"{kind}: it does not say what it is made of")


def _annotated_form(parts: tuple[Any, ...]) -> _Form:
    limits = [part for part in parts[1:] if isinstance(part, Meta)]
    form, make = _form(parts[0])
    if parts[0] is int:  # its own limits stand in the place of those of 64 bits
        form, limits = int, [*limits, *_of_64_bits(limits)]
    return (Annotated[(form, *limits)] if limits else form), make


def _of_64_bits(limits: list[Meta]) -> Iterator[Meta]:
    """What else limits a whole number on the side where nothing does."""
    if all(each.ge is None and each.gt is None for each in limits):
        yield Meta(ge=-(1 << 63))
    if all(each.le is None and each.lt is None for each in limits):
        yield Meta(le=(1 << 63) - 1)


def _tuple_form(parts: tuple[Any, ...]) -> _Form:
    if parts[-1:] == (...,):
        form, make = _form(parts[0])
        return GenericAlias(tuple, (form, ...)), lambda said: tuple(map(make, said))
    forms = [_form(part) for part in parts]
    makes = [make for _, make in forms]
    return (
        GenericAlias(tuple, tuple(form for form, _ in forms)),
        lambda said: tuple(make(each) for make, each in zip(makes, said, strict=True)),
    )


def _list_form(parts: tuple[Any, ...]) -> _Form:
    form, make = _form(parts[0])
    return GenericAlias(list, (form,)), lambda said: [make(each) for each in said]


def _dict_form(parts: tuple[Any, ...]) -> _Form:
    if parts[0] is not str:
        raise TypeError(f"{parts[0]}: expected texts as keys")
    form, make = _form(parts[1])
    return (
        GenericAlias(dict, (str, form)),
        lambda said: {name: make(each) for name, each in said.items()},
    )


def _union_form(parts: tuple[Any, ...]) -> _Form:
    """None and one other type, or several types, of which the first that fits is taken."""
    others = [part for part in parts if part is not NoneType]
    if len(others) == 1:
        form, make = _form(others[0])
        return form | None, lambda said: None if said is None else make(said)
    readers = [_reading(*_form(part)) for part in others]

    def first(said: Raw) -> object:
        if NoneType in parts and bytes(said) == b"null":
            return None
        reasons = []
        for read in readers:
            try:
                return read(said)
            except Exception as error:  # noqa: BLE001 -- as `reader_of`: what a class does not take
                reasons.append(str(error) or type(error).__name__)
        raise ValueError("; ".join(reasons))

    return Raw, first


def _reading(form: Any, make: _Make) -> Callable[[Raw], object]:  # noqa: ANN401 -- a type hint
    decode = msgspec.json.Decoder(form).decode
    return lambda said: make(decode(said))


def _record_form(kind: type[Any]) -> _Form:
    """A record whose fields that have a default may be left out: the class fills them in."""
    hints, optional = get_type_hints(kind, include_extras=True), defaults_of(kind)
    forms = {name: _form(hints[name]) for name in fields_of(kind)}
    fields = [_field(name, form, name in optional) for name, (form, _) in forms.items()]
    struct = msgspec.defstruct(kind.__name__, fields, forbid_unknown_fields=True, kw_only=True)

    def record(said: object) -> object:
        stated = {name: getattr(said, name) for name in forms}
        return kind(
            **{name: forms[name][1](each) for name, each in stated.items() if _is_said(each)}
        )

    return struct, record


def _field(name: str, form: Any, is_optional: bool) -> tuple[Any, ...]:  # noqa: ANN401, FBT001
    """One field of a struct; what stands for one that was left out no datagram can bear."""
    if not is_optional:
        return (name, form)
    if form is Raw:
        return (name, form, Raw())
    return (name, form | msgspec.UnsetType, msgspec.UNSET)


def _is_said(found: object) -> bool:
    return found is not msgspec.UNSET and not (isinstance(found, Raw) and not bytes(found))


def has_fields(kind: type[Any]) -> bool:
    """Whether a class is a record: a dataclass, a named tuple or a Struct."""
    return is_dataclass(kind) or hasattr(kind, "_fields") or issubclass(kind, msgspec.Struct)


def fields_of(kind: type[Any]) -> list[str]:
    """The fields that a record is given."""
    if is_dataclass(kind):
        return [field.name for field in dataclasses.fields(kind) if field.init]
    return list(kind.__struct_fields__ if issubclass(kind, msgspec.Struct) else kind._fields)


def defaults_of(kind: type[Any]) -> dict[str, object]:
    """The fields that a record need not be given, with what they are then."""
    if is_dataclass(kind):
        return {
            field.name: field.default
            for field in dataclasses.fields(kind)
            if not (field.default is field.default_factory is dataclasses.MISSING)
        }
    if issubclass(kind, msgspec.Struct):
        return {
            field.name: field.default
            for field in msgspec.structs.fields(kind)
            if not field.required
        }
    return dict(kind._field_defaults)


_GENERIC: Final[dict[Any, Callable[[tuple[Any, ...]], _Form]]] = {
    Annotated: _annotated_form,
    Literal: lambda parts: (Literal[parts], _same),
    Union: _union_form,
    UnionType: _union_form,
    tuple: _tuple_form,
    list: _list_form,
    dict: _dict_form,
}
"""By what a hint is made from."""


def _same(said: object) -> object:
    return said
