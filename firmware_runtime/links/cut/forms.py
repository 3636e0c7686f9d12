"""How values of a type are packed for a link: its form, by what the type is made of.

What each looks like in MessagePack stands in `packed`. Only classes that this process has already,
and that are subclasses of the declared one, are ever made of what arrives. A type that leaves open
what is in it (`object`, `tuple`) cannot be carried.
"""

import dataclasses
from collections.abc import Callable, Mapping
from enum import Enum
from functools import lru_cache
from types import NoneType, UnionType
from typing import (
    Annotated,
    Any,
    Final,
    Literal,
    NamedTuple,
    TypeAlias,
    Union,
    cast,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec
from msgspec.msgpack import Decoder, Encoder, Ext

from firmware_runtime.errors import with_article

SUBCLASS: Final = 1
ARRAY: Final = 2
LARGE: Final = 3
_SMALLEST, _LARGEST = -(1 << 63), (1 << 64) - 1
_PLAIN: Final = (NoneType, bool, int, float, str, bytes)
_ARRAY_KINDS: Final = "biuf"

_Convert: TypeAlias = Callable[[Any], Any]
_Make: TypeAlias = Callable[[Any], "Form"]


class Form(NamedTuple):
    """How values of one type are packed; `text` describes the type, by its parts."""

    text: str
    pack: _Convert
    """Makes what MessagePack has a word for. Raises TypeError for another type's value."""
    unpack: _Convert
    """The way back. Raises whatever the wrong value raises."""


encode: Final = Encoder().encode
decode: Final = Decoder(ext_hook=lambda code, data: Ext(code, bytes(data))).decode

_remember: Final[Callable[[_Make], _Make]] = lru_cache(maxsize=None)  # a hint can be looked up


@_remember
def form_of(kind: Any) -> Form:  # noqa: ANN401 -- a type hint
    """The form of a type. Raises TypeError for one that does not say what it is made of."""
    origin, parts = get_origin(kind), get_args(kind)
    if type(origin or kind).__name__ == "TypeAliasType":  # `type Name = ...`, as numpy's NDArray
        return form_of((origin or kind).__value__)
    if _is_array(origin or kind):
        return Form("array", _pack_array, array_of)
    if origin in _GENERIC and parts:
        return _GENERIC[origin](parts)
    if isinstance(kind, type) and not parts:
        return _of_class(kind)
    raise TypeError(f"{kind}: it does not say what it is made of")


def _of_class(kind: type[Any]) -> Form:
    """The form of a class, whose subclasses go by their own names."""
    own = _exact(kind)

    def pack(value: object) -> object:
        found = type(value)
        if found is kind:
            return own.pack(value)
        if found in _PLAIN and (found, kind) in {(int, float), (bool, int), (bool, float)}:
            return _exact(found).pack(value)
        if issubclass(found, kind):
            return Ext(SUBCLASS, encode([_name(found), _exact(found).pack(value)]))
        raise TypeError(f"{value!r}: not {with_article(kind.__name__)}")

    def unpack(found: object) -> object:
        if isinstance(found, Ext) and found.code == SUBCLASS:
            name, inner = decode(bytes(found.data))
            return _exact(_subclass(kind, name)).unpack(inner)
        if kind is float and type(found) in {int, bool}:
            return found
        if kind is int and type(found) is bool:
            return found
        return own.unpack(found)

    return Form(own.text, pack, unpack)


@_remember
def _exact(kind: type[Any]) -> Form:
    """The form of instances of this very class."""
    if kind is int:
        return Form("int", _pack_int, _unpack_int)
    if kind in _PLAIN:
        return Form(kind.__name__, lambda value: value, _checked(kind))
    if issubclass(kind, Enum):
        text = f"{kind.__name__}[{','.join(kind.__members__)}]"
        return Form(text, lambda value: value.name, kind.__getitem__)
    if dataclasses.is_dataclass(kind) or issubclass(kind, msgspec.Struct):
        return _record(kind)
    if issubclass(kind, tuple) and hasattr(kind, "_fields"):
        return _record(kind)
    base = next((each for each in kind.__mro__ if each in _PLAIN), None)
    if base is not None:  # such as numpy's float64, which is a float
        plain, make = _exact(base), cast("_Convert", base)
        return Form(
            kind.__name__,
            lambda value: plain.pack(make(value)),
            lambda found: kind(plain.unpack(found)),
        )
    raise TypeError(f"{kind.__name__}: it does not say what it is made of")


def _checked(kind: type[Any]) -> _Convert:
    def unpack(found: object) -> object:
        if type(found) is not kind:
            raise TypeError(f"{type(found).__name__}: expected {kind.__name__}")
        return found

    return unpack


def _pack_int(value: int) -> object:
    return value if _SMALLEST <= value <= _LARGEST else Ext(LARGE, str(value).encode())


def _unpack_int(found: object) -> int:
    if isinstance(found, Ext) and found.code == LARGE:
        return int(bytes(found.data))
    if type(found) is not int:
        raise TypeError(f"{type(found).__name__}: expected int")
    return found


def _record(kind: type[Any]) -> Form:
    """A named tuple, dataclass or struct: its fields, in order."""
    hints = get_type_hints(kind)
    names = _field_names(kind)
    forms = [(name, form_of(hints[name])) for name in names]
    text = f"{kind.__name__}({','.join(f'{name}:{form.text}' for name, form in forms)})"

    def unpack(found: list[Any]) -> object:
        made = zip(forms, found, strict=True)
        return kind(**{name: form.unpack(each) for (name, form), each in made})

    def pack(value: object) -> object:
        return [form.pack(getattr(value, name)) for name, form in forms]

    return Form(text, pack, unpack)


def _field_names(kind: type[Any]) -> list[str]:
    if dataclasses.is_dataclass(kind):
        fields = dataclasses.fields(kind)
        if hidden := [field.name for field in fields if not field.init]:
            raise TypeError(f"{kind.__name__}: {hidden[0]} is not made of what is given to it")
        return [field.name for field in fields]
    names = kind.__struct_fields__ if issubclass(kind, msgspec.Struct) else kind._fields
    return list(names)


def _tuple(parts: tuple[Any, ...]) -> Form:
    if parts[-1] is ...:
        return _sequence(form_of(parts[0]), tuple)
    forms = [form_of(part) for part in parts]
    return Form(
        f"tuple[{','.join(form.text for form in forms)}]",
        lambda value: [form.pack(each) for form, each in zip(forms, value, strict=True)],
        lambda found: tuple(
            form.unpack(each) for form, each in zip(forms, _list_of(found), strict=True)
        ),
    )


def _sequence(form: Form, kind: type[list[Any]] | type[tuple[Any, ...]]) -> Form:
    return Form(
        f"{kind.__name__}[{form.text},...]",
        lambda value: [form.pack(each) for each in value],
        lambda found: kind(form.unpack(each) for each in _list_of(found)),
    )


def _list_of(found: object) -> list[Any]:
    """What must be an array: a text is a sequence too."""
    if not isinstance(found, list):
        raise TypeError(f"{type(found).__name__}: expected an array")
    return found


def _map(parts: tuple[Any, ...]) -> Form:
    if parts[0] is not str:
        raise TypeError(f"dict[{parts[0].__name__}, ...]: expected texts as keys")
    form, text = form_of(parts[1]), _checked(str)

    def unpack(found: Mapping[str, Any]) -> object:
        return {text(name): form.unpack(each) for name, each in found.items()}

    return Form(
        f"dict[str,{form.text}]",
        lambda value: {name: form.pack(each) for name, each in value.items()},
        unpack,
    )


def _union(parts: tuple[Any, ...]) -> Form:
    """One of several types; with None as the only other one, the value itself."""
    others = [part for part in parts if part is not NoneType]
    forms = [form_of(part) for part in others]
    text = "|".join([*(form.text for form in forms), *(["None"] if NoneType in parts else [])])

    def pack(value: object) -> object:
        if value is None and NoneType in parts:
            return None
        if len(forms) == 1:
            return forms[0].pack(value)
        for number, form in enumerate(forms):
            try:
                return [number, form.pack(value)]
            except (TypeError, AttributeError, ValueError):
                continue
        raise TypeError(f"{value!r}: not {with_article(text)}")

    def unpack(found: Any) -> object:  # noqa: ANN401 -- what MessagePack bears
        if found is None and NoneType in parts:
            return None
        if len(forms) == 1:
            return forms[0].unpack(found)
        number, inner = found
        return forms[number].unpack(inner)

    return Form(text, pack, unpack)


_GENERIC: Final[dict[Any, _Make]] = {
    Annotated: lambda parts: form_of(parts[0]),
    Literal: lambda parts: _union(tuple(dict.fromkeys(map(type, parts)))),
    Union: _union,
    UnionType: _union,
    tuple: _tuple,
    list: lambda parts: _sequence(form_of(parts[0]), list),
    dict: _map,
}
"""By what a hint is made from."""


# Subclasses and arrays ---------------------------------------------------------------------------


def _name(kind: type[Any]) -> str:
    """By which a class is found at the other end."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _subclass(kind: type[Any], name: str) -> type[Any]:
    """The subclass of this name that there is in this process already.

    The last one made: a dataclass with slots is made twice, and the first is good for nothing.
    """
    found, waiting = None, [kind]
    while waiting:
        for each in type.__subclasses__(waiting.pop()):
            found = each if _name(each) == name else found
            waiting.append(each)
    if found is None:
        raise TypeError(f"{name}: no subclass of {kind.__name__} here")
    return found


def _is_array(kind: Any) -> bool:  # noqa: ANN401 -- a class, or a hint
    return (getattr(kind, "__module__", ""), getattr(kind, "__name__", "")) == ("numpy", "ndarray")


def _pack_array(value: Any) -> Ext:  # noqa: ANN401 -- numpy takes long to import
    if not _is_array(type(value)) or value.dtype.kind not in _ARRAY_KINDS:
        raise TypeError(f"{type(value).__name__}: expected an array of numbers")
    return Ext(ARRAY, encode([value.dtype.str, list(value.shape), value.tobytes()]))


def array_of(found: Ext) -> Any:  # noqa: ANN401 -- as above
    """The array of numbers in an extension. Raises TypeError for what is none."""
    from numpy import dtype, frombuffer  # noqa: PLC0415 -- only where arrays are carried

    if found.code != ARRAY:
        raise TypeError("expected an array of numbers")
    code, shape, content = decode(bytes(found.data))
    if (kind := dtype(code)).kind not in _ARRAY_KINDS:
        raise TypeError(f"{code}: expected numbers")
    return frombuffer(content, kind).reshape(shape)
