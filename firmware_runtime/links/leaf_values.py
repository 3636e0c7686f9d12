"""Parts of the values that `typed_values` writes: numbers, fields of records, arrays, classes."""

import json
from collections.abc import Callable, Iterable
from enum import Enum
from types import NoneType
from typing import Any, Final, NamedTuple, TypeAlias

import msgspec
from msgspec.msgpack import Decoder, Encoder, Ext

SUBCLASS: Final = 1
ARRAY: Final = 2
LARGE: Final = 3
PLAIN: Final = (NoneType, bool, int, float, str, bytes)
REQUIRED: Final = object()
"""In the place of a default that a field has not."""
_INT64: Final = range(-(1 << 63), 1 << 63)
_UINT64: Final = 1 << 64
_ARRAY_KINDS: Final = "biuf"
_Convert: TypeAlias = Callable[[Any], Any]

encode: Final = Encoder().encode
decode: Final = Decoder(ext_hook=lambda code, data: Ext(code, bytes(data))).decode


class Form(NamedTuple):
    """Form of the values of one type; `text` describes the type, down to its last field."""

    text: str
    pack: _Convert
    """Makes what MessagePack has a word for. Raises TypeError for another type's value."""
    unpack: _Convert
    """The way back. Raises whatever the wrong value raises."""


# What was decoded ---------------------------------------------------------------------------------


_ARTICLES: Final[dict[type, str]] = {list: "an array", dict: "an object"}


def unpack_plain(kind: type[Any], found: object) -> Any:  # noqa: ANN401 -- of that class
    """Return what must be of this very class: a text is a sequence too. Raises TypeError."""
    if type(found) is not kind:
        raise TypeError(f"{found!r:.40}: expected {_ARTICLES.get(kind, kind.__name__)}")
    return found


def unpack_number(found: object) -> float:
    """Return what must be a number, as a float. Raises TypeError."""
    return float(found) if type(found) is int else unpack_plain(float, found)


def pack_int(value: int) -> object:
    """Return an int as MessagePack has it; its digits, beyond 64 bits."""
    is_small = _INT64.start <= value < _UINT64
    return value if is_small else Ext(LARGE, str(value).encode())


def unpack_int(found: object, *, in_json: bool) -> int:
    """Return what must be an int, in JSON of 64 bits. Raises TypeError or ValueError."""
    if isinstance(found, Ext) and found.code == LARGE:
        return int(bytes(found.data))
    number: int = unpack_plain(int, found)
    if in_json and number not in _INT64:
        raise ValueError(f"{number!r:.40}: expected a whole number of 64 bits")
    return number


# Records ------------------------------------------------------------------------------------------


def is_record(kind: type[Any]) -> bool:
    """Return whether a class is a dataclass, a named tuple or a Struct."""
    is_named = issubclass(kind, tuple) and hasattr(kind, "_fields")
    return is_named or hasattr(kind, "__dataclass_fields__") or issubclass(kind, msgspec.Struct)


def field_defaults(kind: type[Any]) -> dict[str, object]:
    """Return the fields that a record is made of, in order, with their defaults or REQUIRED.

    Raises TypeError for a dataclass that computes one.
    """
    names: tuple[str, ...] | None = getattr(kind, "_fields", None)
    if names is not None:
        defaults: dict[str, object] = getattr(kind, "_field_defaults", {})
        return dict.fromkeys(names, REQUIRED) | defaults
    if issubclass(kind, msgspec.Struct):
        return {
            each.name: REQUIRED if each.required else each.default
            for each in msgspec.structs.fields(kind)
        }
    import dataclasses  # noqa: PLC0415 -- loaded already where there is one

    fields = dataclasses.fields(kind)
    if hidden := [field.name for field in fields if not field.init]:
        raise TypeError(f"{kind.__name__}: {hidden[0]} is not made of what is given to it")
    missing = dataclasses.MISSING
    return {
        each.name: REQUIRED if each.default is each.default_factory is missing else each.default
        for each in fields
    }


def default_text(default: object) -> str:
    """Return how a field's default is shown behind its type, ` = 0.0`; empty for REQUIRED."""
    if default is REQUIRED:
        return ""
    try:
        return f" = {json.dumps(default.name if isinstance(default, Enum) else default)}"
    except (TypeError, ValueError):
        return " = ..."


def any_of(texts: Iterable[object]) -> str:
    """Return these as JSON, with bars between them."""
    return " | ".join(json.dumps(each, default=str) for each in texts)


# Classes and arrays -------------------------------------------------------------------------------


def class_name(kind: type[Any]) -> str:
    """Return the name by which a class is found at the other end."""
    return f"{kind.__module__}:{kind.__qualname__}"


def subclass_named(kind: type[Any], name: str) -> type[Any]:
    """Return the subclass of this name that there is in this process already. Raises TypeError.

    The last one made: a dataclass with slots is made twice, and the first is good for nothing.
    """
    found, waiting = None, [kind]
    while waiting:
        for each in type.__subclasses__(waiting.pop()):
            found = each if class_name(each) == name else found
            waiting.append(each)
    if found is None:
        raise TypeError(f"{name}: no subclass of {kind.__name__} here")
    return found


def is_array(kind: object) -> bool:
    """Return whether a class or a hint is numpy's array."""
    return (getattr(kind, "__module__", ""), getattr(kind, "__name__", "")) == ("numpy", "ndarray")


def pack_array(value: Any) -> Ext:  # noqa: ANN401 -- numpy takes long to import
    """Return an array of numbers as an extension. Raises TypeError for anything else."""
    if not is_array(type(value)) or value.dtype.kind not in _ARRAY_KINDS:
        raise TypeError(f"{type(value).__name__}: expected an array of numbers")
    return Ext(ARRAY, encode([value.dtype.str, list(value.shape), value.tobytes()]))


def array_of(found: Ext) -> Any:  # noqa: ANN401 -- as above
    """Return the array of numbers in an extension. Raises TypeError for what is none."""
    from numpy import dtype, frombuffer  # noqa: PLC0415 -- only where arrays are carried

    if found.code != ARRAY:
        raise TypeError("expected an array of numbers")
    code, shape, content = decode(bytes(found.data))
    if (kind := dtype(code)).kind not in _ARRAY_KINDS:
        raise TypeError(f"{code}: expected numbers")
    return frombuffer(content, kind).reshape(shape)


# Forms --------------------------------------------------------------------------------------------


def same(value: object) -> object:
    """Return the value itself."""
    return value


def first_that_fits(forms: list[Form], found: object) -> object:
    """Return the value of the first type that takes what was found. Raises ValueError."""
    reasons = []
    for form in forms:
        try:
            return form.unpack(found)
        except Exception as error:  # noqa: BLE001 -- whatever a class does not take
            reasons.append(str(error) or type(error).__name__)
    raise ValueError("; ".join(reasons))
