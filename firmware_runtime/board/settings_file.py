"""A board's settings as a run keeps them in a file: its table, and where that came from.

{"source": "/home/pi/mine.toml", "table": {"board": "tachobot", ...}}
"""

import os
from contextlib import suppress
from pathlib import Path

import msgspec

from firmware_runtime.board import strict
from firmware_runtime.board.installed import FILE
from firmware_runtime.board.registry import Board, board_of
from firmware_runtime.errors import ConfigError
from firmware_runtime.system.atomic_file import read_text


def kept_table(board: Board) -> str:
    """A board's `table` as JSON, with the path of the file that it came from."""
    kept = {"source": os.path.realpath(board.source), "table": board.table}
    return msgspec.json.encode(kept).decode()


def load_table(kept: Path) -> Board:
    """The board of a `table` that was kept in a file. Raises ConfigError, also if there is none."""
    _, table = _kept(kept)
    if not isinstance(table, dict):
        raise ConfigError(str(kept), [f"{type(table).__name__}; expected a JSON object"])
    faults: list[str] = []
    table = strict.bounded(table, faults)
    if faults:
        raise ConfigError(str(kept), faults)
    return board_of(kept, (), table, [])


def is_kept_of(kept: Path, board: str) -> bool:
    """Return whether a kept table came from the file at a path, or in its folder."""
    with suppress(ConfigError):
        return _kept(kept)[0] in {os.path.realpath(each) for each in (board, Path(board) / FILE)}
    return False


def _kept(path: Path) -> tuple[object, object]:
    """The file that a kept table came from, and the table. Raises ConfigError."""
    try:
        kept = msgspec.json.decode(read_text(path))
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        raise ConfigError(str(path), [f"{error}; expected JSON"]) from error
    if isinstance(kept, dict) and "board" not in kept:
        return kept.get("source"), kept.get("table")
    return None, kept  # as earlier versions kept it
