"""Recordings in which something is another, with right checksums: what a hostile one would be."""

import random
from collections.abc import Iterator, Sequence
from typing import Any

import msgspec

from firmware_runtime.blackbox.chunk_file import Numbered, file_of

STRANGE: Sequence[Any] = (
    *(None, True, False, 0, 1, -1, 7, 255, 1 << 31, 1 << 62, (1 << 64) - 1, -(1 << 63)),
    *(0.0, -1.5, 1e300, float("inf"), float("nan")),
    *("", "x", "a\nb", '"""', "\\", "../..", "builtins:object", "os:path", "\x00"),
    *(b"", b"\xff", b"\x00" * 40),
    *([], {}, [[]], [None], {"": 0}, {"int": ["x"]}, {"array": ["<f8", [1 << 40], b""]}),
    *({"list": 3}, {"unknown": "x:y"}, {"a:b": [1]}, {"array": ["O", [1], b"12345678"]}),
)
"""What is put in the place of something else."""


def deep(levels: int) -> msgspec.Raw:
    """Lists in one another, deeper than an encoder goes."""
    return msgspec.Raw(b"\x91" * levels + b"\x90")


def mutated(chunks: Sequence[Sequence[bytes]], chance: random.Random) -> bytes:
    """A recording of these chunks of sections, something in one or two of them another."""
    changed = [list(each) for each in chunks]
    for _ in range(chance.choice((1, 1, 2))):
        sections = chance.choice(changed)
        place = chance.randrange(len(sections))
        sections[place] = _mutated(sections[place], chance)
        if chance.random() < 0.05:
            sections.insert(place, chance.choice(chance.choice(changed)))
    return file_of([Numbered(number, each) for number, each in enumerate(changed, start=1)])


def _mutated(content: bytes, chance: random.Random) -> bytes:
    if chance.random() < 0.15:
        damaged = bytearray(content)
        damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        return bytes(damaged)
    try:
        section = msgspec.msgpack.decode(content)
    except (msgspec.MsgspecError, ValueError, RecursionError):  # changed before
        return content
    places = [*_places(section)]
    holder, key = chance.choice(places[1:] or places)
    value = holder[key]
    holder[key] = _other(value, chance)
    return msgspec.msgpack.encode(section)


def _other(value: Any, chance: random.Random) -> Any:  # noqa: ANN401 -- whatever a section has
    if type(value) is int and chance.random() < 0.4:
        return max(-(1 << 63), min(value + chance.choice((-1000, -1, 1, 2, 1000)), (1 << 63) - 1))
    if isinstance(value, bytes) and value and chance.random() < 0.5:
        damaged = bytearray(value)
        damaged[chance.randrange(len(damaged))] = chance.randrange(256)
        return bytes(damaged)
    if isinstance(value, list) and value and chance.random() < 0.5:
        return chance.choice((value[1:], value[:-1], value * 2, value[::-1]))
    if isinstance(value, str) and value and chance.random() < 0.3:
        return value + chance.choice(("x", "\n", '"""\nimport os\n"""', "\\", "."))
    if chance.random() < 0.03:
        return deep(chance.choice((10, 150, 250, 5000)))
    return chance.choice(STRANGE)


def _places(value: Any) -> Iterator[tuple[Any, Any]]:  # noqa: ANN401 -- of lists and maps
    """Each list or map of a section, with a place in it."""
    keys: Sequence[Any] = range(len(value)) if isinstance(value, list) else [*value]
    for key in keys:
        yield value, key
        if isinstance(value[key], list | dict):
            yield from _places(value[key])
