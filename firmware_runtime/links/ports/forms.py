"""What a value looks like that a port takes, in words for a person who is to write one.

    float, int, bool, str                  the same
    an enumeration                         "DRY" | "WET"
    a record                               {"depth_m": float, "surge": float = 0.0}
    tuple[float, float], tuple[int, ...]   [float, float], [int, ...], as is list[float]
    dict[str, int]                         {str: int}
    float | None                           float | null

It says in words what `values` reads.
"""

import json
from collections.abc import Callable, Iterator
from enum import Enum
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin, get_type_hints

from firmware_runtime.links.ports.values import defaults_of, fields_of, has_fields

LONGEST: Final = 400
"""Letters; a form that is longer is cut."""
_PLAIN: Final = {bool, int, float, str}


def form_of(port_type: type[object]) -> str | None:
    """How a value of a type is written; None for a plain one, which its name says."""
    if port_type in _PLAIN:
        return None
    text = _form(port_type)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def _form(hint: Any) -> str:  # noqa: ANN401 -- a type hint, and all of these
    origin, parts = get_origin(hint), get_args(hint)
    if origin in _GENERIC and parts:
        return _GENERIC[origin](parts)
    if hint is NoneType:
        return "null"
    if isinstance(hint, type) and issubclass(hint, Enum):
        return _any_of(hint.__members__)
    if isinstance(hint, type) and has_fields(hint):
        return f"{{{', '.join(_fields(hint))}}}"
    return getattr(hint, "__name__", str(hint))


def _fields(kind: type[Any]) -> Iterator[str]:
    hints, defaults = get_type_hints(kind, include_extras=True), defaults_of(kind)
    for name in fields_of(kind):
        default = f" = {_shown(defaults[name])}" if name in defaults else ""
        yield f"{json.dumps(name)}: {_form(hints[name])}{default}"


def _shown(default: object) -> str:
    if isinstance(default, Enum):
        return json.dumps(default.name)
    try:
        return json.dumps(default)
    except (TypeError, ValueError):
        return "..."


def _any_of(texts: Any) -> str:  # noqa: ANN401
    return " | ".join(json.dumps(each) for each in texts)


def _array(parts: tuple[Any, ...]) -> str:
    return f"[{', '.join('...' if part is ... else _form(part) for part in parts)}]"


_GENERIC: Final[dict[Any, Callable[[tuple[Any, ...]], str]]] = {
    Annotated: lambda parts: _form(parts[0]),
    Literal: _any_of,
    Union: lambda parts: " | ".join(map(_form, parts)),
    UnionType: lambda parts: " | ".join(map(_form, parts)),
    tuple: _array,
    list: lambda parts: _array((*parts, ...)),
    dict: lambda parts: f"{{{_form(parts[0])}: {_form(parts[1])}}}",
}
"""By what a hint is made from."""
