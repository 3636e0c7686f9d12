"""The first number or text in which two recorded values differ, by the names of the fields to it.

Values are in the form of `recording.values`; what a state keeps of an object of a class of its own
are bytes within bytes. Floats are shown with their bits, for two may look alike.
"""

import struct
from collections.abc import Iterator
from itertools import zip_longest
from typing import Any, Final, NamedTuple

import msgspec

from firmware_runtime.recording.values import UnknownValue, field_names, unpack

_NONE: Final = object()
_MAPS: Final = ("dict", "list", "int")


class Leaf(NamedTuple):
    """Names joined by dots, and the two values there as texts."""

    path: str
    recorded: str
    replayed: str
    units_apart: int | None


def first_leaf(recorded: bytes, replayed: bytes) -> Leaf:
    """Where two values that are not the same bytes differ first."""
    found = next(_leaves(_opened(recorded), _opened(replayed), ()), None)
    return found or Leaf("", recorded.hex(), replayed.hex(), None)


def shown(value: object) -> str:
    """A value as text, a float with its bits."""
    if value is _NONE:
        return "nothing"
    return f"{value!r} ({value.hex()})" if isinstance(value, float) else repr(value)


def units_apart(one: object, other: object) -> int | None:
    """How many floats further the other is; None where one is none."""
    if isinstance(one, float) and isinstance(other, float):
        return abs(_place(one) - _place(other))
    return None


def _leaves(one: Any, other: Any, path: tuple[str, ...]) -> Iterator[Leaf]:  # noqa: ANN401
    """Every place in which two values differ, in order."""
    ours, theirs = _parts(one), _parts(other)
    if ours is not None and theirs is not None:
        for left, right in zip_longest(ours, theirs, fillvalue=("", _NONE)):
            name = left[0] or right[0]
            yield from _leaves(left[1], right[1], (*path, name) if name else path)
    elif _bits(one) != _bits(other):
        yield Leaf(".".join(path), shown(one), shown(other), units_apart(one, other))


def _parts(value: Any) -> list[tuple[str, Any]] | None:  # noqa: ANN401 -- any recorded form
    """The named parts of a value; None for one that has none."""
    if isinstance(value, bytes):
        inside = _opened(value)
        return None if inside is value else [("", inside)]
    if isinstance(value, list):
        return _of_list(value)
    if not isinstance(value, dict) or len(value) != 1:
        return None
    ((kind, parts),) = value.items()
    if kind in {"array", "scalar"}:
        return _of_array(parts)
    if kind == "dict":
        return [(str(key), part) for key, part in parts]
    names = () if kind in _MAPS else _names(kind)
    return [("", kind), *_named(names, parts)]


def _of_list(value: list[Any]) -> list[tuple[str, Any]]:
    """The items of a tuple; of an object's attributes, as a state keeps them, by their names."""
    if len(value) == 3 and isinstance(value[2], list) and all(map(_is_pair, value[2])):
        return [("", value[0]), ("", value[1]), *((name, part) for name, part in value[2])]
    return [(str(number), part) for number, part in enumerate(value)]


def _is_pair(value: object) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and isinstance(value[0], str)
        and isinstance(value[1], bytes)
    )


def _of_array(parts: Any) -> list[tuple[str, Any]] | None:  # noqa: ANN401 -- of a file
    """The numbers of an array of floats; None for one of another kind."""
    kind, shape, content = parts
    code = {"<f8": "d", "<f4": "f"}.get(kind)
    if code is None:
        return None
    numbers = (number for (number,) in struct.iter_unpack(f"<{code}", content))
    return [("", str(shape)), *((str(place), each) for place, each in enumerate(numbers))]


def _named(names: tuple[str, ...], parts: list[Any]) -> Iterator[tuple[str, Any]]:
    for number, part in enumerate(parts):
        yield names[number] if number < len(names) else str(number), part


def _names(kind: str) -> tuple[str, ...]:
    try:
        return field_names(kind)
    except UnknownValue:
        return ()


def _opened(content: bytes) -> Any:  # noqa: ANN401 -- any recorded form
    """What bytes hold; the bytes themselves if nothing."""
    try:
        return unpack(content)
    except msgspec.MsgspecError:
        return content


def _bits(value: object) -> object:
    return (float, struct.pack("<d", value)) if isinstance(value, float) else (type(value), value)


def _place(value: float) -> int:
    """The place of a float among all floats in order of size."""
    (bits,) = struct.unpack("<q", struct.pack("<d", value))
    return int(bits if bits >= 0 else -(1 << 63) - bits)
