"""The settings in force on this machine: what a board's name means here.

That is the user's copy in /etc/firmware-runtime, which `service install` makes, or else what is
shipped. A robot with a name of its own, one of two of a kind, has its copy there only. A path means
that file.
"""

import os
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board

SETTINGS = "/etc/firmware-runtime"
PLACE = "FIRMWARE_RUNTIME_SETTINGS_DIRECTORY"
"""Names another directory for settings in force, as tests need."""
_ENDING = ".toml"


def board_in_force(board: str, assignments: Sequence[str] = ()) -> Board:
    """Read the board that is meant. Raises ConfigError with every fault found."""
    copy = settings_in_force(board)
    if copy is None:
        return registry.load(board, assignments, own_names())
    return registry.load_copy(copy, board, assignments)


def settings_in_force(board: str) -> Path | None:
    """The user's copy of the settings of a board of that name, if there is one."""
    if not registry.is_name(board):
        return None
    copy = settings_place() / f"{board}{_ENDING}"
    return copy if os.path.exists(copy) else None  # noqa: PTH110 -- pathlib's raise


def own_names() -> list[str]:
    """The robots whose settings are in force here by a name that is no kind's."""
    try:
        files = sorted(os.listdir(settings_place()))  # noqa: PTH208 -- names are all that is wanted
    except OSError:
        return []  # none were installed, or this user may not look
    names = [file.removesuffix(_ENDING) for file in files if file.endswith(_ENDING)]
    return [name for name in names if name not in kinds.names()]


def known_names() -> list[str]:
    """Every board that can be named here: the kinds, then robots with a name of their own."""
    return [*kinds.names(), *own_names()]


def settings_place() -> Path:
    """The directory of the settings in force."""
    return Path(os.environ.get(PLACE) or SETTINGS)
