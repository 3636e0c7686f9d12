"""The settings that a run drives by, kept beside its statistics until its outputs are off.

A board's file may be changed, or broken, while a robot runs by what stood there before. Switching
that run off must reach its chips and not those of the file: `BOARD.settings` has them,
overrides of the command line included, and the path of the file they came from:

    {"source": "/home/pi/mine.toml", "table": {"board": "tachobot", ...}}
"""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from firmware_runtime.board.registry import Board
from firmware_runtime.board.settings_file import is_kept_of, kept_table, load_table
from firmware_runtime.errors import ConfigError, StatisticsFileError
from firmware_runtime.statistics.paths import SUFFIX, Companion
from firmware_runtime.system.atomic_file import OWN_AND_GROUP, replace_file


def keep_settings(board: Board, statistics: Path) -> None:
    """Keep a board's settings; the file is whole at any instant. Raises StatisticsFileError."""
    path = Companion.SETTINGS.beside(statistics)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, kept_table(board).encode(), OWN_AND_GROUP)
    except OSError as error:
        raise StatisticsFileError(
            error.strerror, where=path, expected="a place to write"
        ) from error


def kept_settings(statistics: Path | None) -> Board | None:
    """Return what a run left in force; None if all its outputs are off, or it is not legible."""
    if statistics is None:
        return None
    try:
        return load_table(Companion.SETTINGS.beside(statistics))
    except ConfigError:
        return None


def kept_for(board: str, directories: Iterable[Path]) -> list[Path]:
    """The statistics of the runs in these directories whose settings came from this file."""
    return [
        path.with_suffix(SUFFIX)
        for directory in directories
        for path in sorted(directory.glob(f"*{Companion.SETTINGS}"))
        if is_kept_of(path, board)
    ]


def forget_settings(statistics: Path | None) -> None:
    """To be called when all outputs are off; what may not be removed stays, to be switched off."""
    if statistics is not None:
        with suppress(OSError):
            Companion.SETTINGS.beside(statistics).unlink()
