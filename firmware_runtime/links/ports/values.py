"""Values as datagrams bear them: read back from the form in which a trace shows them.

    port's type                            in the datagram
    bool, int, float, str                  true, 1, 1.5, "text"; a float may be written 1
    an enumeration                         the name of its member
    a named tuple or dataclass             an object with all of its fields and no others
    tuple[float, float], tuple[int, ...]   an array; as a field's type, since a port's is a class

Everything is read by the declared types, down to the last field, so a model never finds a text
where it expects a number. A type that leaves open what is in it (`tuple`, `object`) is not read at
all. JSON has no numbers that are not finite; one too large for a float, or a whole one for 64 bits,
is refused.
"""

from collections.abc import Callable
from dataclasses import is_dataclass
from enum import Enum
from types import GenericAlias
from typing import Annotated, Any, Literal, TypeAlias, get_args, get_origin, get_type_hints

import msgspec
from msgspec import Meta

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
    if get_origin(kind) is tuple:
        return _tuple_form(get_args(kind))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return Literal[tuple(kind.__members__)], kind.__getitem__
    if isinstance(kind, type) and (is_dataclass(kind) or hasattr(kind, "_fields")):
        return _record_form(kind)
    raise TypeError(f"{kind}: it does not say what it is made of")


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


def _record_form(kind: Callable[..., object]) -> _Form:
    forms = {name: _form(hint) for name, hint in get_type_hints(kind).items()}
    struct = msgspec.defstruct(
        kind.__name__,
        [(name, form) for name, (form, _) in forms.items()],
        forbid_unknown_fields=True,
    )

    def record(said: object) -> object:
        return kind(**{name: make(getattr(said, name)) for name, (_, make) in forms.items()})

    return struct, record


def _same(said: object) -> object:
    return said
