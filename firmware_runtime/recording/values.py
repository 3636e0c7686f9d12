"""Values in a recording: MessagePack from which the same value comes back, floats to the bit.

None, truth values, whole numbers of 64 bits, floats, texts and bytes are themselves; a tuple is an
array; everything else is a map of one key, which says what it is:

    {"list": [...]}                         its items; so "set", "frozenset" and "bytearray"
    {"dict": [[key, value], ...]}           so "ordered", an OrderedDict
    {"deque": [[...], 3]}                   its items, and the most it holds or None
    {"int": ["18446744073709551616"]}       one too large for 64 bits
    {"complex": [1.0, 2.0]}
    {"numbers": ["q", bytes]}               an array.array
    {"array": ["<f8", [3], bytes]}          of numpy; with "scalar" one of its numbers
    {"random": [3, bytes, None]}            where a random.Random stands
    {"generator": ["PCG64", {"dict": ...}]} where a generator of numpy stands
    {"firmware_drivers.thrust_pairs:Forces": [...]}  fields of a named tuple, dataclass or Struct
    {"package.module:Colour": ["RED"]}      a member of an enumeration; of a Flag also its number

and in the state of a robot

    {"known": [12]}                         an object that the robot had from the start
    {"same": [3]}                           what has been made as the fourth, met again

This list is closed. Nothing of a file is run: a class is looked up in a module that the model has
imported, must be defined there and hold fields alone, and is made without its own functions
(`records`).
"""

from enum import Enum
from typing import Any, Final

import msgspec

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.records import UnknownValue, class_named, name_of, record_of
from firmware_runtime.recording.value_reader import Reader
from firmware_runtime.recording.value_writer import DEEPEST, GENERATORS, Plain, Writer, encode

__all__ = ["GENERATORS", "Plain", "Reader", "UnknownValue", "Writer"]

_decode: Final = msgspec.msgpack.Decoder().decode
_NUMBERS: Final = frozenset({"array", "scalar", "numbers"})
_DEEPEST_FORM: Final = 3 * DEEPEST
"""A dictionary is written as a map of a list of pairs."""


def plain(value: object) -> Plain:
    """A value in MessagePack's types. Raises UnknownValue."""
    return Writer().plain(value)


def encoded(value: object) -> bytes:
    """A value as bytes; the same bytes mean the same value, floats to the bit.

    Raises UnknownValue, also for a text that UTF-8 has not.
    """
    try:
        return encode(plain(value))
    except UnknownValue:
        raise
    except Exception as error:
        fault = f"{name_of(type(value))} cannot be recorded; {type(error).__name__}: {error}"
        raise UnknownValue(legible(fault)) from error


def legible(text: str) -> str:
    """A text that UTF-8 has: what came from outside may have lone surrogates."""
    return text.encode("utf-8", "backslashreplace").decode()


def made(of: Plain) -> Any:  # noqa: ANN401 -- whatever a port carries
    """The value that `plain` was made of. Raises UnknownValue."""
    return Reader().made(of)


def made_for(name: str, form: Plain) -> object:
    """As `made`, of what a recording has by this name. Raises ConfigError."""
    try:
        return made(form)
    except UnknownValue as error:
        raise ConfigError.of_one("recording", f"{name}: {error}") from error


def numbers_in(form: Plain) -> Any:  # noqa: ANN401 -- whatever a port carries
    """The same with numbers and lists of them for what numpy had, or an array."""
    if isinstance(form, list):
        return [numbers_in(each) for each in form]
    if not isinstance(form, dict):
        return form
    if len(form) == 1 and _NUMBERS.issuperset(form):
        try:
            return made(form).tolist()
        except (UnknownValue, AttributeError):
            return form
    return {key: numbers_in(each) for key, each in form.items()}


def field_names(name: str) -> tuple[str, ...]:
    """The fields of a class as a recording names it. Raises UnknownValue."""
    kind = class_named(name)
    return () if issubclass(kind, Enum) else record_of(kind).names


def pack(structure: Plain) -> bytes:
    """Plain values as bytes."""
    return encode(structure)


def unpack(content: bytes) -> Plain:
    """Plain values of bytes. Raises msgspec.DecodeError."""
    try:
        return shallow(_decode(content))
    except (UnicodeDecodeError, RecursionError) as error:  # of a text, or too deep
        raise msgspec.DecodeError(text_of(error)) from error


def shallow(form: Plain) -> Plain:
    """The same, which nothing that goes through it has to fear for its stack.

    Raises msgspec.DecodeError.
    """
    level = [form]
    for _ in range(_DEEPEST_FORM):
        inner = [each for each in level if isinstance(each, list | dict | tuple)]
        if not inner:
            return form
        level = [part for each in inner for part in each]
        level += [part for each in inner if isinstance(each, dict) for part in each.values()]
    raise msgspec.DecodeError(f"over {_DEEPEST_FORM} lists within each other")
