"""Every key that the files of a kind of board may have, as its schema says, present or not."""

from collections.abc import Iterator
from types import NoneType
from typing import get_args, get_origin, get_type_hints

from msgspec import Struct, structs

from firmware_runtime.board.variants import is_struct

ANY = "*"
"""In the place of a table's name that the file chooses."""


def may_have(schema: type[Struct], pattern: str) -> bool:
    """Return whether a file of this schema may have a key like `controller.*.kp`."""
    wanted = pattern.split(".")
    return any(
        len(key) == len(wanted)
        and all(ANY in {word, want} or word == want for word, want in zip(key, wanted, strict=True))
        for key in _keys(schema)
    )


def _keys(type_: object) -> Iterator[tuple[str, ...]]:
    """The words of each key below a type; one empty key of a type that is no table."""
    if is_struct(type_):
        hints = get_type_hints(type_, include_extras=True)
        for field in structs.fields(type_):
            for below in _keys(hints[field.name]):
                yield (field.encode_name, *below)
    elif get_origin(type_) is dict:
        for below in _keys(get_args(type_)[1]):
            yield (ANY, *below)
    elif tables := [each for each in get_args(type_) if is_struct(each)]:
        for each in tables:
            yield from _keys(each)
        if any(
            each not in {*tables, NoneType} for each in get_args(type_) if isinstance(each, type)
        ):
            yield ()
    else:
        yield ()
