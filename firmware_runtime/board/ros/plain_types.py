"""What needs no convention: truth values, numbers, texts, enumerations, and records of numbers.

    bool, int, float, str    std_msgs Bool, Int64, Float64, String
    an enumeration           String, the member's name
    a named tuple, dataclass or tuple of numbers, at any depth
                             Float64MultiArray: the numbers in the order of the fields; one
                             dimension, its label the names of all, such as `f1,f2,f3,f4`

In a record a truth value counts as 0 or 1, and what is not there (None) as NaN.
"""

from collections.abc import Iterator
from dataclasses import is_dataclass
from enum import Enum
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from firmware_runtime.board.ros.conventions import (
    Convention,
    Fields,
    Incoming,
    Options,
    Outgoing,
)

_NUMBERS = (bool, int, float)
_ARRAY = "std_msgs/msg/Float64MultiArray"
_LARGEST = 1 << 63


def plain_convention(kind: type[object]) -> Convention | None:
    """What values of a type are in ROS 2; None if the type is none of these."""
    for plain, message in (
        (bool, "Bool"),
        (int, "Int64"),
        (float, "Float64"),
        (str, "String"),
        (Enum, "String"),
    ):
        if issubclass(kind, plain):
            return _of_one_value(kind, f"std_msgs/msg/{message}")
    if not _is_numbers(kind):
        return None
    into = () if (names := _names(kind)) is None else (_record(kind, names),)
    return Convention(of=kind, out=(Outgoing(type=_ARRAY, fields=_array),), into=into)


def _of_one_value(kind: type[object], message: str) -> Convention:
    def fields(value: object, _options: Options) -> Fields:
        if message.endswith("Int64") and not -_LARGEST <= int(str(value)) < _LARGEST:
            raise ValueError(f"{value}: expected a whole number of 64 bits")
        return {"data": float(str(value)) if message.endswith("Float64") else value}

    def read(said: Any, _options: Options) -> object:  # noqa: ANN401 -- a message of any type
        return said.data

    out = (Outgoing(type=message, fields=fields),)
    return Convention(of=kind, out=out, into=(Incoming(type=message, value=read),))


def _record(kind: type[object], names: tuple[str, ...]) -> Incoming:
    """A record whose fields are single numbers, made of an array of as many."""
    types = get_type_hints(kind)

    def read(said: Any, _options: Options) -> object:  # noqa: ANN401
        if len(said.data) != len(names):
            found = f"{len(said.data)} numbers"
            raise ValueError(f"{found}, expected {len(names)}: {', '.join(names)}")
        return {
            name: _whole(number) if types[name] is int else float(number)
            for name, number in zip(names, said.data, strict=True)
        }

    return Incoming(type=_ARRAY, value=read)


def _whole(number: float) -> int:
    if not number.is_integer():
        raise ValueError(f"{number}, expected a whole number")
    return int(number)


def _names(kind: type[object]) -> tuple[str, ...] | None:
    """The fields of a record of single numbers; None for anything else."""
    if not _is_record(kind):
        return None
    hints = get_type_hints(kind)
    return tuple(hints) if all(each in {int, float} for each in hints.values()) else None


def _is_numbers(kind: Any) -> bool:  # noqa: ANN401 -- a type hint
    """Whether values of a type consist of numbers alone; `tuple` and `list` may."""
    if kind in _NUMBERS or kind in {tuple, list}:
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
