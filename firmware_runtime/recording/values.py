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

from collections.abc import Callable
from enum import Enum
from typing import Any, Final

import msgspec

from firmware_runtime.errors import ConfigError, text_of
from firmware_runtime.recording.records import UnknownValue, class_named, record_of
from firmware_runtime.recording.value_reader import Reader
from firmware_runtime.recording.value_writer import GENERATORS, Plain, Writer, encode

__all__ = ["GENERATORS", "Plain", "Reader", "UnknownValue", "Writer"]

_decode: Final = msgspec.msgpack.Decoder().decode
_NUMBERS: Final = frozenset({"array", "scalar", "numbers"})


def plain(value: object) -> Plain:
    """A value in MessagePack's types. Raises UnknownValue."""
    return Writer().plain(value)


def encoded(value: object) -> bytes:
    """A value as bytes; the same bytes mean the same value, floats to the bit.

    Raises UnknownValue, also for a text that UTF-8 has not.
    """
    return pack(plain(value))


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
    """Plain values as bytes. Raises UnknownValue for a text that UTF-8 has not."""
    try:
        return encode(structure)
    except UnicodeEncodeError as error:
        raise UnknownValue(f"cannot be recorded ({text_of(error)})") from error


def unpack(content: bytes) -> Plain:
    """Plain values of bytes. Raises msgspec.DecodeError."""
    return decoded(_decode, content)


def decoded(decode: Callable[[bytes], Any], content: bytes) -> Any:  # noqa: ANN401 -- as it returns
    """What a decoder of MessagePack makes of bytes. Raises msgspec.DecodeError."""
    if is_too_deep(content):
        raise msgspec.ValidationError(f"more than {MOST_DEPTH} lists and maps in one another")
    try:
        return decode(content)
    except (UnicodeDecodeError, RecursionError) as error:  # of a text, or too deep
        raise msgspec.ValidationError(text_of(error)) from error


MOST_DEPTH: Final = 200
"""Of lists and maps within another: what goes deeper is no section that a run has written."""
_NO_CONTAINERS: Final = bytes({*range(256)} - {*range(0x80, 0xA0), *range(0xDC, 0xE0)})
_LENGTHS: Final = {0xC4: 1, 0xC5: 2, 0xC6: 4, 0xD9: 1, 0xDA: 2, 0xDB: 4, 0xC7: 1, 0xC8: 2, 0xC9: 4}
"""Bytes of the length of what has one: bytes, texts, extensions."""
_SIZES: Final = dict(
    zip(range(0xCA, 0xD9), (4, 8, 1, 2, 4, 8, 1, 2, 4, 8, 2, 3, 5, 9, 17), strict=True)
)
"""Bytes of numbers, and of extensions of a fixed length."""
_COUNTS: Final = {0xDC: (2, 1), 0xDD: (4, 1), 0xDE: (2, 2), 0xDF: (4, 2)}
"""Of lists and maps: bytes of their length, and things in an item."""


def is_too_deep(content: bytes) -> bool:
    """Whether MessagePack has more lists and maps in one another than a stack may have room for."""
    if len(content.translate(None, _NO_CONTAINERS)) <= MOST_DEPTH:
        return False
    left, place, end = [1], 0, len(content)
    while place < end and left:
        if left[-1] == 0:
            left.pop()
            continue
        left[-1] -= 1
        place, items = _passed(content, place)
        if items:
            left.append(items)
            if len(left) - 1 > MOST_DEPTH:  # the first is no list, it is the whole
                return True
    return False


def _passed(content: bytes, place: int) -> tuple[int, int]:
    """Where what stands there ends, or begins with its items, and how many these are."""
    byte = content[place]
    if byte in _COUNTS:
        length, times = _COUNTS[byte]
        count = int.from_bytes(content[place + 1 : place + 1 + length], "big")
        return place + 1 + length, times * count
    if 0x80 <= byte < 0xA0:
        return place + 1, (byte & 0x0F) * (2 if byte < 0x90 else 1)
    if 0xA0 <= byte < 0xC0:
        return place + 1 + (byte & 0x1F), 0
    if byte in _LENGTHS:
        length = _LENGTHS[byte]
        size = int.from_bytes(content[place + 1 : place + 1 + length], "big")
        return place + 1 + length + size + (0xC7 <= byte <= 0xC9), 0
    return place + 1 + _SIZES.get(byte, 0), 0
