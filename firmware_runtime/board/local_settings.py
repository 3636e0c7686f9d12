"""The settings in force on this machine: what a board's name means here.

That is the user's copy in /etc/firmware-runtime, which `service install` makes, or else what is
shipped. A robot with a name of its own, one of two of a kind, has its copy there only. A path means
that file.

A run keeps them in a file: its table, and where that came from.

    {"source": "/home/pi/mine.toml", "table": {"board": "tachobot", ...}}
"""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry, strict
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
    text = read_text(kept)
    _, table = _kept(kept, text)
    if not isinstance(table, dict):
        raise ConfigError(str(kept), [f"{type(table).__name__}; expected a JSON object"])
    faults: list[str] = []
    table = strict.bounded(table, faults)
    if faults:
        raise ConfigError(str(kept), faults)
    return board_of(kept, text, (), table, [])


def is_kept_of(kept: Path, board: str) -> bool:
    """Return whether a kept table came from the file at a path, or in its folder."""
    with suppress(ConfigError):
        return _kept(kept, read_text(kept))[0] in {
            os.path.realpath(each) for each in (board, Path(board) / FILE)
        }
    return False


def _kept(path: Path, text: str) -> tuple[object, object]:
    """The file that a kept table came from, and the table. Raises ConfigError."""
    try:
        kept = msgspec.json.decode(text)
    except (ValueError, RecursionError) as error:  # msgspec's errors are ValueErrors
        raise ConfigError(str(path), [f"{error}; expected JSON"]) from error
    if isinstance(kept, dict) and "board" not in kept:
        return kept.get("source"), kept.get("table")
    return None, kept  # as earlier versions kept it


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
