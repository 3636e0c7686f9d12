"""Messages for plain types: truth values, numbers, texts, enumerations, numeric records.

    bool, int, float, str    std_msgs Bool, Int64, Float64, String
    an enumeration           String, the member's name
    a named tuple, dataclass or tuple of numbers, at any depth
                             Float64MultiArray: the numbers in the order of the fields; one
                             dimension, its label the names of all, such as `f1,f2,f3,f4`

In a record a truth value counts as 0 or 1, and what is not there (None) as NaN. Numbers in an array
that comes are one for each field, so a record is taken only if each of its fields is a number.
"""

from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass, replace
from enum import Enum
from types import NoneType, UnionType
from typing import Any, Final, Union, get_args, get_origin, get_type_hints

from firmware_runtime.board.ros.conventions import (
    Convention,
    Fields,
    Incoming,
    Options,
    Outgoing,
)
from firmware_runtime.models.motion import Motion

BOOL: Final = "std_msgs/msg/Bool"
INT: Final = "std_msgs/msg/Int64"
FLOAT: Final = "std_msgs/msg/Float64"
TEXT: Final = "std_msgs/msg/String"
ARRAY: Final = "std_msgs/msg/Float64MultiArray"

_SINGLE: Final[tuple[tuple[type[object], str], ...]] = (
    (bool, BOOL),
    (int, INT),
    (float, FLOAT),
    (str, TEXT),
    (Enum, TEXT),
)
_LARGEST: Final = 1 << 63


def plain_convention(kind: type[object]) -> Convention | None:
    """Return the convention of a plain type; None if the type is none."""
    for plain, message in _SINGLE:
        if issubclass(kind, plain):
            out = (plain_outgoing(message),)
            return Convention(of=kind, out=out, into=(plain_incoming(message),))
    if not _is_numbers(kind):
        return None
    record = _record(kind)
    into = () if record is None else (plain_incoming(ARRAY, record),)
    return Convention(of=kind, out=(plain_outgoing(ARRAY),), into=into)


def plain_outgoing(message: str) -> Outgoing:
    """Return how a value becomes one of these messages; no measurement means an event."""
    fields = {ARRAY: _array, INT: _whole_number, FLOAT: _number}.get(message, _as_it_is)
    return Outgoing(type=message, fields=fields, is_event=message in {BOOL, INT, TEXT})


def plain_incoming(message: str, record: Mapping[str, bool] | None = None) -> Incoming:
    """Return how a value is made of one of these; of an array, by fields and whole numbers."""
    if message != ARRAY or record is None:
        return Incoming(type=message, value=lambda said, _options: said.data)

    def read(said: Any, _options: Options) -> object:  # noqa: ANN401 -- a message of any type
        if len(said.data) != len(record):
            found = f"{len(said.data)} numbers"
            raise ValueError(f"{found}, expected {len(record)}: {', '.join(record)}")
        pairs = zip(record.items(), said.data, strict=True)
        return {name: _whole(each) if whole else float(each) for (name, whole), each in pairs}

    return Incoming(type=ARRAY, value=read, record=record)


# Types --------------------------------------------------------------------------------------------


def _record(kind: type[object]) -> dict[str, bool] | None:
    """The fields of a record of single numbers, and which are whole; None for anything else."""
    if not _is_record(kind):
        return None
    hints = get_type_hints(kind)
    if any(each not in {int, float} for each in hints.values()):
        return None
    return {name: each is int for name, each in hints.items()}


def _is_numbers(kind: Any) -> bool:  # noqa: ANN401 -- a type hint
    """Return whether values of a type are numbers alone; those of `tuple` and `list` may be."""
    if kind in {bool, int, float, tuple, list}:
        return True
    if get_origin(kind) in {Union, UnionType}:
        return all(_is_numbers(each) for each in get_args(kind) if each is not NoneType)
    if get_origin(kind) is tuple:
        return all(_is_numbers(each) for each in get_args(kind) if each is not ...)
    if not _is_record(kind):
        return hasattr(kind, "tolist")  # numpy's types have it
    try:
        hints = get_type_hints(kind)
    except (TypeError, NameError):
        return False
    return all(map(_is_numbers, hints.values())) and bool(hints)


def _is_record(kind: Any) -> bool:  # noqa: ANN401
    return isinstance(kind, type) and (is_dataclass(kind) or hasattr(kind, "_fields"))


# Values -------------------------------------------------------------------------------------------


def _as_it_is(value: object, _options: Options) -> Fields:
    return {"data": value}


def _number(value: Any, _options: Options) -> Fields:  # noqa: ANN401 -- as JSON shows it
    return {"data": float(value)}


def _whole_number(value: Any, _options: Options) -> Fields:  # noqa: ANN401
    if not -_LARGEST <= value < _LARGEST:
        raise ValueError(f"{value}: expected a whole number of 64 bits")
    return {"data": value}


def _whole(number: float) -> int:
    if not number.is_integer():
        raise ValueError(f"{number}, expected a whole number")
    return int(number)


def _array(value: object, _options: Options) -> Fields:
    """Raises TypeError for what is no number after all."""
    pairs = list(_flat(value, ""))
    label = ",".join(name for name, _ in pairs)
    dimension = {"label": label, "size": len(pairs), "stride": len(pairs)}
    return {
        "layout": {"dim": [dimension], "data_offset": 0},
        "data": [number for _, number in pairs],
    }


def _flat(value: object, name: str) -> Iterator[tuple[str, float]]:
    """Every number in a value, with its name: `acceleration.0`."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield from _flat(each, f"{name}.{key}" if name else key)
    elif isinstance(value, list | tuple):
        for number, each in enumerate(value):
            yield from _flat(each, f"{name}.{number}" if name else str(number))
    elif value is None:
        yield name, float("nan")
    elif isinstance(value, int | float) or value in {"nan", "inf", "-inf"}:
        yield name, float(value)
    else:
        raise TypeError(f"{name or 'value'}: {value!r}, expected a number")


MOTION: Final = Convention(
    of=Motion,
    out=(plain_outgoing(ARRAY),),
    into=(replace(plain_incoming(ARRAY, {"position": False, "rate": False}), is_sensor=True),),
)
"""What is measured, here or elsewhere: one that is lost is replaced by the next."""
