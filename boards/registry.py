"""Finds boards: those that come with the project by name, a user's own copy by its file."""

import hashlib
import importlib
import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, cast

from boards import strict
from boards.common import (
    ArmingSettings,
    BusSettings,
    ExecutiveSettings,
    GuardSettings,
    ModelPolicy,
    OutputEnableSettings,
    PathDeadlineSettings,
    PortSettings,
)
from boards.faults import Device, executive_faults, overrun_faults
from boards.lines import Lines
from boards.robot import Robot
from boards.variants import drop_replaced
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import BoardError
from firmware_runtime.hal.budget import BusLoad
from firmware_runtime.spelling import did_you_mean
from firmware_runtime.telemetry.whole_file import read_file

_FOLDER = Path(__file__).parent
FILE = "board.toml"


class BoardSettings(Protocol):
    """What every board's settings hold, whatever else they hold."""

    @property
    def board(self) -> str: ...  # noqa: D102 -- the names say it, see boards.common
    @property
    def description(self) -> str: ...  # noqa: D102
    @property
    def buses(self) -> dict[str, BusSettings]: ...  # noqa: D102
    @property
    def executive(self) -> ExecutiveSettings: ...  # noqa: D102
    @property
    def arming(self) -> ArmingSettings: ...  # noqa: D102
    @property
    def guard(self) -> GuardSettings: ...  # noqa: D102
    @property
    def output_enable(self) -> OutputEnableSettings | None: ...  # noqa: D102
    @property
    def overruns(self) -> dict[str, ModelPolicy]: ...  # noqa: D102
    @property
    def deadlines(self) -> tuple[PathDeadlineSettings, ...]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Board:
    """A board whose settings were read and found sound."""

    name: str
    source: Path
    assignments: Sequence[str]
    """Overrides of single numbers, `KEY=VALUE`."""
    settings: Any
    """The board's own settings class; satisfies `BoardSettings`."""
    table: Mapping[str, Any]
    """What the settings were made of: the file's keys, overridden."""
    devices: Sequence[Device]
    """Every chip on an I2C bus that the board needs."""
    loads: Mapping[str, BusLoad]
    """What the board asks of each bus."""
    doubles_run_s: float
    """How long a run on doubles takes when nobody says."""
    warnings: Sequence[str]
    ports: Mapping[str, PortSettings]
    """The serial ports it uses, if any."""
    build: Callable[[Lines], Robot]
    event_model: Callable[[Path | None], Component] | None
    """The model alone, its own or that of a `.ma` file, if event files can be run on it."""
    retunable: Sequence[str]
    """Keys that may change while the robot runs; `*` stands for any word."""
    fingerprint: str
    """SHA-256 over the file and the overrides, for the conditions of a run."""


def names() -> list[str]:
    """The boards that come with the project, in alphabetical order."""
    return sorted(path.parent.name for path in _FOLDER.glob(f"*/{FILE}"))


def load(board: str, assignments: Sequence[str] = ()) -> Board:
    """Read a board by name, or by the path of a board.toml or of its folder.

    Raises BoardError with every fault found.
    """
    source = _locate(board)
    faults: list[str] = []
    table = strict.parse_toml(_read(source), faults)
    if faults:
        raise BoardError(str(source), faults)
    strict.override(table, assignments, faults)
    if table.get("board") in names():
        drop_replaced(table, _definition(table["board"]).SETTINGS, _assigned(assignments))
    return _board(source, assignments, table, faults)


def load_copy(copy: Path, name: str, assignments: Sequence[str] = ()) -> Board:
    """Read a user's copy of the settings of a board. Raises BoardError, also if it is another's."""
    board = load(str(copy), assignments)
    if board.name != name:
        fault = f"board: {board.name!r}: expected {name!r}, by the file's name"
        raise BoardError(str(copy), [fault])
    return board


def kept_table(board: Board) -> str:
    """A board's `table` as JSON, with the path of the file that it came from."""
    return json.dumps({"source": os.path.realpath(board.source), "table": board.table})


def load_table(kept: Path) -> Board:
    """The board of a `table` that was kept in a file. Raises BoardError, also if there is none."""
    _, table = _kept(kept)
    if not isinstance(table, dict):
        raise BoardError(str(kept), [f"{type(table).__name__}; expected a JSON object"])
    faults: list[str] = []
    table = strict.bounded(table, faults)
    if faults:
        raise BoardError(str(kept), faults)
    return _board(kept, (), table, [])


def is_kept_of(kept: Path, board: str) -> bool:
    """Whether a kept table came from the file at a path, or in its folder, be it there or not."""
    with suppress(BoardError):
        return _kept(kept)[0] in {os.path.realpath(each) for each in (board, Path(board) / FILE)}
    return False


def _kept(path: Path) -> tuple[object, object]:
    """The file that a kept table came from, and the table. Raises BoardError."""
    try:
        kept = json.loads(_read(path))
    except (ValueError, RecursionError) as error:
        raise BoardError(str(path), [f"{error}; expected JSON"]) from error
    if isinstance(kept, dict) and "board" not in kept:
        return kept.get("source"), kept.get("table")
    return None, kept  # as earlier versions kept it


def _board(
    source: Path, assignments: Sequence[str], table: dict[str, Any], faults: list[str]
) -> Board:
    """The board of a table; raises BoardError with every fault, those found before included."""
    kind = table.get("board")
    if kind not in names():
        found = f"board: {strict.shown(kind)}" if "board" in table else "no key 'board'"
        fault = f"{found}: expected one of {_listing()}"
        raise BoardError(str(source), [*faults, fault])
    definition = _definition(kind)
    settings = strict.convert(table, definition.SETTINGS, faults)
    if settings is None:
        raise BoardError(str(source), faults)
    faults += executive_faults(settings.executive, settings.guard)
    faults += [*overrun_faults(settings.overruns), *definition.faults(settings)]
    loads = {} if faults else definition.loads(settings)
    faults += [fault for load_ in loads.values() if (fault := load_.fault())]
    if faults:
        raise BoardError(str(source), faults)
    return Board(
        name=cast("str", kind),
        source=source,
        assignments=assignments,
        settings=settings,
        table=table,
        devices=definition.devices(settings),
        loads=loads,
        doubles_run_s=definition.DOUBLES_RUN_S,
        warnings=[text for load_ in loads.values() if (text := load_.warning())],
        ports=getattr(settings, "ports", {}),
        build=lambda lines: definition.build(settings, lines),
        event_model=_event_model(definition, settings),
        retunable=definition.RETUNABLE,
        fingerprint=_fingerprint(source, assignments),
    )


def _definition(kind: str) -> ModuleType:
    return importlib.import_module(f"boards.{kind}.definition")


def _assigned(assignments: Sequence[str]) -> set[str]:
    """The keys that assignments name, and the tables these are in."""
    keys = [each.partition("=")[0].strip().split(".") for each in assignments]
    return {".".join(key[:depth]) for key in keys for depth in range(1, len(key) + 1)}


def _event_model(
    definition: ModuleType, settings: object
) -> Callable[[Path | None], Component] | None:
    build: Callable[[object, Path | None], Component] | None
    build = getattr(definition, "event_model", None)
    return None if build is None else lambda model_file: build(settings, model_file)


def _locate(board: str) -> Path:
    if board in names():
        return _FOLDER / board / FILE
    path = Path(board)
    if os.path.isdir(path):  # noqa: PTH112 -- pathlib's raise for a closed folder or a long name
        path /= FILE
    if os.path.isfile(path):  # noqa: PTH113
        return path
    raise BoardError(board, [_not_found(board)])


def _not_found(board: str) -> str:
    expected = f"expected one of {_listing()}, or a {FILE} file"
    if not (os.sep in board or Path(board).suffix or os.path.exists(board)):  # noqa: PTH110
        return f"unknown board; {expected}{did_you_mean(board, names())}"
    if os.path.isdir(board):  # noqa: PTH112 -- as above
        return f"no {FILE} in this folder; {expected}"
    return f"{_why_no_file(board)}; {expected}"


def _why_no_file(path: str) -> str:
    try:
        os.stat(path)  # noqa: PTH116 -- the same path as above, unaltered
    except FileNotFoundError:
        return "no such file"
    except OSError as error:
        return f"cannot be found ({error.strerror})"
    return "no regular file"


def _read(source: Path) -> str:
    try:
        return read_file(source).decode()
    except (OSError, UnicodeDecodeError) as error:
        raise BoardError(str(source), [f"cannot be read: {error}"]) from error


def _listing() -> str:
    return ", ".join(names())


def _fingerprint(source: Path, assignments: Sequence[str]) -> str:
    return hashlib.sha256("\n".join([_read(source), *assignments]).encode()).hexdigest()
