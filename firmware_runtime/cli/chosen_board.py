"""The board that the command line names.

A name means the settings in force on this machine: the user's copy in /etc/firmware-runtime, which
`service install` makes, or else what is shipped. A path means that file.
"""

import os
import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from firmware_runtime.board import kinds, registry
from firmware_runtime.board.registry import Board
from firmware_runtime.cli.readers_gone import tell
from firmware_runtime.host.installation.places import SETTINGS

PLACE = "FIRMWARE_RUNTIME_SETTINGS_DIRECTORY"
"""Names another directory for settings in force, as tests need."""


def chosen_board(board: str, assignments: Sequence[str] = ()) -> Board:
    """Read the board that is meant, and say so where that is not what is shipped.

    Raises ConfigError with every fault found.
    """
    copy = settings_in_force(board)
    if copy is None:
        return registry.load(board, assignments)
    _tell_once(f"firmware-runtime: {board} has its settings from {copy}")
    return registry.load_copy(copy, board, assignments)


@cache
def _tell_once(what: str) -> None:
    """A verb may read a board more than once."""
    tell(what, sys.stderr)


def settings_in_force(board: str) -> Path | None:
    """The user's copy of the settings of a board of that name, if there is one."""
    copy = Path(os.environ.get(PLACE) or SETTINGS, f"{board}.toml")
    is_there = board in kinds.names() and os.path.exists(copy)  # noqa: PTH110
    return copy if is_there else None
