"""Where recordings are: beside the statistics of the run, one for real and one for virtual time."""

import os
from pathlib import Path

from firmware_runtime.blackbox.layout import MAGIC
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.companions import Companion
from firmware_runtime.statistics.paths import default_path, places

VIRTUAL = f".virtual{Companion.RECORDING}"


def recording_beside(statistics: Path) -> Path:
    """Where a run with these statistics keeps its recording."""
    return Companion.RECORDING.beside(statistics)


def recording_of_virtual_run(board: str) -> Path:
    """Where a run in virtual time, which has no statistics that others see, keeps its recording."""
    return default_path(board).with_suffix(VIRTUAL)


def find_recording(run: str) -> Path:
    """The recording that is meant: a file, or the last run of a board.

    Raises ConfigError, a sentence, if there is none.
    """
    if os.sep in run or Path(run).is_file():
        return Path(run)
    beside = [
        path
        for statistics in places(run)
        for path in (recording_beside(statistics), statistics.with_suffix(VIRTUAL))
        if path.is_file()
    ]
    if not beside:
        looked_in = ", ".join(dict.fromkeys(str(each.parent) for each in places(run)))
        fault = f"no file, and no run of a board of this name has left a recording in {looked_in}"
        raise ConfigError.of_one(run, f"{fault}; expected a recording's file, or a board")
    return max(beside, key=lambda path: path.stat().st_mtime_ns)


def is_black_box(path: Path) -> bool:
    """Whether a file begins as a recording of the black box does."""
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False
