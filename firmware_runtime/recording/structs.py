"""Structs made field by field, as they were written: after their own `__post_init__`."""

from collections.abc import Mapping
from functools import cache
from typing import Any, Final

import msgspec

_CLASS: Final[Any] = vars(object)["__class__"]


def empty_struct(kind: type[msgspec.Struct]) -> Any:  # noqa: ANN401 -- of that class
    """One whose fields are None, and still to be set; no function of its class is run."""
    plain = _without_post_init(kind)
    made = plain(**dict.fromkeys(kind.__struct_fields__))
    if plain is not kind:
        _CLASS.__set__(made, kind)  # a frozen one lets nothing be set by its own functions
    return made


def struct_of(kind: type[msgspec.Struct], values: Mapping[str, object]) -> Any:  # noqa: ANN401
    """One with these fields."""
    made = empty_struct(kind)
    for name, value in values.items():
        getattr(kind, name).__set__(made, value)
    return made


@cache
def _without_post_init(kind: type[msgspec.Struct]) -> Any:  # noqa: ANN401 -- a class
    """A class like it that has nothing to run."""
    if not hasattr(kind, "__post_init__"):
        return kind
    like_it: Any = type(kind)
    return like_it(kind.__name__, (kind,), {"__post_init__": _nothing})


def _nothing(_: object) -> None:
    """In place of a model's own `__post_init__`."""
