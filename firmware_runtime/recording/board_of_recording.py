"""Other settings than those of a recorded run: the board by them, and which keys differ."""

import json
from collections.abc import Mapping, Sequence
from copy import deepcopy
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, TypeAlias

from msgspec import to_builtins
from msgspec.structs import replace

from firmware_runtime.board import strict
from firmware_runtime.board.installed import names, shipped_file
from firmware_runtime.board.local_settings import load_table
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import changed_values
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.recorded_board import RecordedBoard
from firmware_runtime.system.atomic_file import read_text


def board_of(header: RecordedBoard) -> Board:
    """The board by the settings that a recording was made with. Raises ConfigError."""
    return board_of_table(header.source, header.table)


def board_of_table(source: str, table: dict[str, object]) -> Board:
    """The board by a recorded table of settings. Raises ConfigError."""
    try:
        text = json.dumps({"source": source, "table": table})
    except (TypeError, ValueError, RecursionError) as error:
        fault = f"its settings are none ({error}); expected those of a board"
        raise ConfigError.of_one("recording", fault) from error
    with TemporaryDirectory() as folder:
        kept = Path(folder) / "recording.settings"
        kept.write_text(text)
        try:
            return load_table(kept)
        except ConfigError as error:
            if error.where != str(kept):
                raise
            raise ConfigError("settings of the recorded run, by this code", error.faults) from None


Settings: TypeAlias = Mapping[str, Mapping[str, object]]
"""By key, its value in the run (`recorded`) and the one that is tried (`tried`)."""

_SHOWN: Final = 12
_LONGEST: Final = 80
"""Letters of a value in a sentence; a whole table may have come or gone."""


def changed_board(header: RecordedBoard, assignments: Sequence[str]) -> Board:
    """The board by the run's settings, with some set otherwise. Raises ConfigError.

    A key that the code has learned since then has its value from the board's own file.
    """
    table, faults = deepcopy(header.table), list[str]()
    strict.override(table, assignments, faults)
    if faults:
        raise ConfigError("--set", faults)
    try:
        return _assigned(board_of_table(header.source, table), assignments)
    except ConfigError as error:
        if header.kind not in names():
            raise ConfigError("replay", error.faults) from error
        shipped = strict.parse_toml(read_text(shipped_file(header.kind)), [])
        try:
            board = board_of_table(header.source, _filled(table, shipped))
        except ConfigError:
            raise ConfigError("replay", error.faults) from None
        return _assigned(board, assignments)


def changed_settings(recorded: Board, tried: Board) -> dict[str, dict[str, object]]:
    """The keys whose values are not those of the run, as JSON has them; None is no such key."""
    return {
        key: {"recorded": to_builtins(was), "tried": to_builtins(now)}
        for key, was, now in changed_values(recorded.settings, tried.settings)
    }


def settings_said(changed: Settings) -> str:
    """The keys with both values in a row; many of them in short, none in words."""
    if not changed:
        return "no setting differs from the run's"
    said = [
        f"{key}={_value(each['tried'])} (in the run {_value(each['recorded'])})"
        for key, each in islice(changed.items(), _SHOWN)
    ]
    if len(changed) > _SHOWN:
        said.append(f"{len(changed) - _SHOWN} more (--json has them all)")
    return ", ".join(said)


def _value(value: object) -> str:
    text = "none" if value is None else json.dumps(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _assigned(board: Board, assignments: Sequence[str]) -> Board:
    return replace(board, assignments=tuple(assignments))


def _filled(table: Mapping[str, Any], shipped: Mapping[str, Any]) -> dict[str, object]:
    """A table, with what it lacks of another."""
    both = [key for key in table if isinstance(table[key], dict) and key in shipped]
    inner = {
        key: _filled(table[key], shipped[key]) for key in both if isinstance(shipped[key], dict)
    }
    return {**shipped, **table, **inner}
