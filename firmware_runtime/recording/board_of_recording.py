"""The board of a recording, by the settings that it was made with."""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from firmware_runtime.board.registry import Board
from firmware_runtime.board.settings_file import load_table
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.recorded_board import RecordedBoard


def board_of(header: RecordedBoard) -> Board:
    """The board by the settings that a recording was made with. Raises ConfigError."""
    return board_of_table(header.source, header.table)


def board_of_table(source: str, table: dict[str, Any]) -> Board:
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
