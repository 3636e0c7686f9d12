"""The board that the command line names, by the settings in force on this machine, and its run."""

import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.local_settings import board_in_force, settings_in_force
from firmware_runtime.board.registry import Board, is_name
from firmware_runtime.system.terminal import print_line

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd


SUFFIX = ".ma"


def is_model(word: str) -> bool:
    """Whether this is a model file, or an object of a module, rather than a board."""
    return word.endswith(SUFFIX) or (":" in word and not Path(word).exists())


def chosen_board(board: str, assignments: Sequence[str] = ()) -> Board:
    """Read the board that is meant, and say so where that is not what is shipped.

    Raises ConfigError with every fault found.
    """
    if (copy := settings_in_force(board)) is not None:
        _print_once(f"firmware-runtime: {board} has its settings from {copy}")
    return board_in_force(board, assignments)


def chosen_end(run: str, assignments: Sequence[str] = ()) -> "tuple[Board, BoardEnd | None]":
    """Read the board of a run, and which end of it that run has; None for the whole robot.

    `BOARD.ROLE` is what one end of a robot in two processes runs. Raises ConfigError with every
    fault found.
    """
    name, dot, role = run.rpartition(".")
    if dot and is_name(name) and role != "toml":
        from firmware_runtime.board.ends import end_of  # noqa: PLC0415 -- few runs are of one end

        board = chosen_board(name, assignments)
        return board, end_of(board, role)
    return chosen_board(run, assignments), None


def chosen_run(run: str, assignments: Sequence[str] = ()) -> tuple[Board, str]:
    """Read the board of a run, and say by which name its statistics and sockets go.

    The end with the hardware goes by the board's name. Raises ConfigError with every fault found.
    """
    board, end = chosen_end(run, assignments)
    return board, board.name if end is None else end.name


@cache
def _print_once(what: str) -> None:
    """A verb may read a board more than once."""
    print_line(what, sys.stderr)
