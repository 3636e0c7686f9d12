"""The board that the command line names, by the settings in force on this machine."""

import sys
from collections.abc import Sequence
from functools import cache

from firmware_runtime.board.in_force import board_in_force, settings_in_force
from firmware_runtime.board.registry import Board
from firmware_runtime.cli.readers_gone import print_line


def chosen_board(board: str, assignments: Sequence[str] = ()) -> Board:
    """Read the board that is meant, and say so where that is not what is shipped.

    Raises ConfigError with every fault found.
    """
    if (copy := settings_in_force(board)) is not None:
        _print_once(f"firmware-runtime: {board} has its settings from {copy}")
    return board_in_force(board, assignments)


@cache
def _print_once(what: str) -> None:
    """A verb may read a board more than once."""
    print_line(what, sys.stderr)
