"""A copy of a board.toml with other values: comments, order and every other number stay.

It is never written over a file that a robot may be run by: the board's own, those that packages
ship, and those in force on this machine.
"""

import json
import os
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, TypeAlias

from firmware_runtime.board.installed import names, shipped_file
from firmware_runtime.board.local_settings import settings_in_force, settings_place
from firmware_runtime.board.registry import Board
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import keep_output, read_text

Value: TypeAlias = bool | int | float | str
_TABLE: Final = re.compile(r"\s*\[\s*([^\[\]]+?)\s*\]\s*(#.*)?$")
_VALUE: Final = re.compile(r"""(\s*([\w.-]+)\s*=\s*)("(?:[^"\\]|\\.)*"|'[^']*'|[^\s#]+)(.*)$""")


def output_fault(output: Path, board: Board) -> str | None:
    """Return why a copy is not written there, in a sentence; None if it may be.

    Links are followed, and a file counts as itself under any of its names.
    """
    place = Path(os.path.realpath(output))
    if place.is_relative_to(os.path.realpath(settings_place())):
        return f"{output}: settings in force are in {settings_place()}; expected another place"
    for file, of in _in_use(board):
        if _is_same(place, file):
            return f"{output}: is the board.toml {of}; expected another file"
    if output.is_dir() or not os.access(place.parent, os.W_OK):
        return f"{output}: no file that can be written; expected a name in a folder that takes one"
    return None


def _in_use(board: Board) -> Iterator[tuple[Path, str]]:
    yield board.source, f"of {board.name} itself"
    for name in names():
        yield shipped_file(name), f"that is shipped for {name}"
        if (copy := settings_in_force(name)) is not None:
            yield copy, f"in force for {name}"


def _is_same(place: Path, file: Path) -> bool:
    try:
        return place.samefile(file)
    except OSError:
        return place == Path(os.path.realpath(file))


def write_copy(board: Board, values: Mapping[str, Value], output: Path) -> None:
    """Write the copy. Raises ConfigError, with nothing written, where it may or can not be."""
    if (fault := output_fault(output, board)) is not None:
        raise ConfigError("-o", [fault])
    text = changed(read_text(board.source), values)
    keep_output(output, text.encode())


def changed(text: str, values: Mapping[str, Value]) -> str:
    """A file's text with these values at these dotted keys. Raises ConfigError.

    A key that its table leaves out is added at the table's head.
    """
    lines, left = text.splitlines(), dict(values)
    table = ""
    for place, line in enumerate(lines):
        if found := _TABLE.match(line):
            table = f"{found[1]}."
        elif (found := _VALUE.match(line)) and (key := f"{table}{found[2]}") in left:
            lines[place] = f"{found[1]}{as_toml(left.pop(key))}{found[4]}"
    for key, value in left.items():
        lines = _added(lines, key, value)
    written = "\n".join(lines) + "\n"
    if not _differs_in(text, written, values):
        fault = f"{', '.join(values)}: not changed in the file as it is; expected a table for each"
        raise ConfigError("-o", [fault])
    return written


def as_toml(value: Value) -> str:
    """A value as a board.toml has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else repr(value)


def _added(lines: Sequence[str], key: str, value: Value) -> list[str]:
    table, _, name = key.rpartition(".")
    for place, line in enumerate(lines):
        if (found := _TABLE.match(line)) and found[1] == table:
            return [*lines[: place + 1], f"{name} = {as_toml(value)}", *lines[place + 1 :]]
    return [*lines, "", f"[{table}]", f"{name} = {as_toml(value)}"]


def _differs_in(text: str, written: str, values: Mapping[str, Value]) -> bool:
    """Return whether one file is the other with these values, and is a file at all."""
    table: dict[str, Any] = tomllib.loads(text)
    for key, value in values.items():
        *parents, leaf = key.split(".")
        inner = table
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[leaf] = value
    try:
        return tomllib.loads(written) == table
    except tomllib.TOMLDecodeError:
        return False
