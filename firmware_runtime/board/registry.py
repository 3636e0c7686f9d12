"""Reads boards: an installed kind by its name, a user's own copy by its file.

A kind of board is a package's `BoardDefinition` with board.toml beside it, made known by an entry
point, see `definition` and `installed`. The boards that come with the project are found the same
way.
"""

import os
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal

from msgspec import Struct

from firmware_runtime.board import strict
from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.experiments import Experiment, Plant
from firmware_runtime.board.faults import (
    Device,
    SerialDevice,
    device_faults,
    executive_faults,
    unused_lines,
)
from firmware_runtime.board.installed import (
    FILE,
    blamed_on,
    broken,
    definition,
    entry_point_of,
    names,
    shipped_file,
)
from firmware_runtime.board.robot import Lines, Robot, absent_lines, declaring
from firmware_runtime.board.roles import role_faults
from firmware_runtime.board.settings import BoardSettings, LinkSettings, PortSettings
from firmware_runtime.board.variants import drop_replaced
from firmware_runtime.devs.collection import no_collection
from firmware_runtime.devs.component import Component
from firmware_runtime.errors import ConfigError, SettingError, suggested
from firmware_runtime.hal.budget import BusLoad
from firmware_runtime.system.atomic_file import read_text

MOST_WHILE_RUNNING: Final = 1 << 15
"""Characters of a file that is read while a robot runs: six times the longest of ours."""
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,62}")


class Board(Struct, frozen=True):
    """A board whose settings were read and found sound."""

    name: str
    """Its own, by which its statistics, units and sockets are known; the kind's unless stated."""
    kind: str
    """The entry point that it is made by."""
    source: Path
    assignments: Sequence[str]
    """Overrides of single numbers, `KEY=VALUE`."""
    settings: Any
    """The board's own settings class; satisfies `BoardSettings`."""
    table: Mapping[str, Any]
    """What the settings were made of: the file's keys, overridden."""
    devices: Sequence[Device]
    """Every chip on an I2C bus that the board needs."""
    serial_devices: Sequence[SerialDevice]
    """Every chip on a serial port that it needs."""
    loads: Mapping[str, BusLoad]
    """What the board asks of each bus."""
    doubles_run_s: float
    """How long a run on doubles takes unless stated."""
    warnings: Sequence[str]
    ports: Mapping[str, PortSettings]
    """The serial ports it uses, if any."""
    build: Callable[[Lines], Robot]
    event_model: Callable[[Path | None], Component] | None
    """The model alone, its own or that of a `.ma` file, if event files can be run on it."""
    result_text: Callable[[Mapping[str, Any]], str] | None
    """What the robot did in a run with this result, in a sentence, if the package has one."""
    retunable: Sequence[str]
    """Keys that may change while the robot runs; `*` stands for any word."""
    gains: Mapping[str, Sequence[str]]
    """The same by the component that takes them up, as far as the definition says."""
    inputs: Mapping[str, float | Literal["hold"]]
    """How long input ports of the top model may be silent, see `ends`."""
    experiments: Mapping[str, Experiment]
    """What can be tried with it beside what any board can, by name."""
    plant: Plant | None
    """The body that it moves, for `identify` and `tune`."""
    content: str
    """The text of the file, then the overrides, a line each."""

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the content, for the conditions of a run."""
        from hashlib import sha256  # noqa: PLC0415 -- takes 3 ms, before outputs are off

        return sha256(self.content.encode()).hexdigest()

    def absent_lines(self) -> Lines:
        """Its lines, by name, on which nothing can be sent."""
        return absent_lines(self.settings.buses, self.ports)

    def unconnected(self) -> Robot:
        """The robot without its hardware: built on absent lines."""
        return self.build(self.absent_lines())


def is_name(text: str) -> bool:
    """Return whether a robot can be called so; a path with a dot or a slash is no name."""
    return _NAME.fullmatch(text) is not None


def load(
    board: str,
    assignments: Sequence[str] = (),
    others: Sequence[str] = (),
    *,
    running: str | None = None,
) -> Board:
    """Read a board by its kind, or by the path of a board.toml or of its folder.

    `others` are names that mean something to the caller. Where a robot of the kind `running` goes
    on meanwhile, a file that would hold it up is refused: a long one, and that of another kind,
    whose package would be imported. Raises ConfigError with every fault found.
    """
    source = _locate(board, [*names(), *others])
    text = read_text(source)
    if running is not None and len(text) > MOST_WHILE_RUNNING:
        expected = f"expected {MOST_WHILE_RUNNING:,} at most while the robot runs"
        raise ConfigError(str(source), [f"{len(text):,} characters; {expected}"])
    faults: list[str] = []
    table = strict.parse_toml(text, faults)
    if faults:
        raise ConfigError(str(source), faults)
    if running is not None and (kind := table.get("board")) not in (None, running):
        fault = f"board: {strict.shown(kind)}: expected {running!r}, the kind that runs"
        raise ConfigError(str(source), [fault])
    strict.override(table, assignments, faults)
    if board in names() and table.get("board") in [name for name in names() if name != board]:
        fault = f"board: {table['board']!r}: expected {board!r}, as its entry point is called"
        raise ConfigError(str(source), [fault])
    if assignments and table.get("board") in names():
        drop_replaced(table, definition(table["board"]).settings, _assigned(assignments))
    return board_of(source, text, assignments, table, faults)


def load_copy(copy: Path, name: str, assignments: Sequence[str] = ()) -> Board:
    """Read a user's copy of a board's settings. Raises ConfigError, also if it is another's."""
    board = load(str(copy), assignments)
    if board.name != name:
        key = "board" if "name" not in board.table and name in names() else "name"
        fault = f"{key}: {board.name!r}: expected {name!r}, by the file's name"
        raise ConfigError(str(copy), [fault])
    return board


def board_of(
    source: Path, text: str, assignments: Sequence[str], table: dict[str, Any], faults: list[str]
) -> Board:
    """The board of a table, which the file's text has.

    Raises ConfigError with every fault, those found before included.
    """
    kind = _kind_in(source, table, faults)
    name = _name_in(table, kind, faults)
    defined = definition(kind)
    stated = {key: value for key, value in table.items() if key != "name"}
    settings = strict.convert(stated, defined.settings, faults)
    if settings is None:
        raise ConfigError(str(source), faults)
    devices, loads = _wired(defined, settings, faults)
    if faults:
        raise ConfigError(str(source), faults)
    return Board(
        name=name,
        kind=kind,
        source=source,
        assignments=assignments,
        settings=settings,
        table=table,
        devices=devices,
        serial_devices=defined.serial_devices(settings),
        loads=loads,
        doubles_run_s=defined.doubles_run_s,
        warnings=[said for load_ in loads.values() if (said := load_.warning())],
        ports=settings.ports,
        build=partial(_built, defined, settings),
        event_model=_event_model(defined, settings),
        result_text=_result_text(defined, settings),
        retunable=defined.retunable_keys,
        gains=defined.gains,
        inputs=defined.inputs,
        experiments=defined.experiments,
        plant=defined.plant,
        content="\n".join([text, *assignments]),
    )


def _kind_in(source: Path, table: Mapping[str, Any], faults: Sequence[str]) -> str:
    """The kind of board that a table is of. Raises ConfigError where that is not one."""
    kind: str | None = table.get("board")
    if kind is None or kind not in names():
        found = f"board: {strict.shown(kind)}" if "board" in table else "no key 'board'"
        fault = f"{found}: expected that of an installed package, {' or '.join(names())}"
        raise ConfigError(str(source), [*faults, fault])
    return kind


def _name_in(table: Mapping[str, Any], kind: str, faults: list[str]) -> str:
    """A robot's own name, or that of its kind; one that cannot be a name is among the faults."""
    name = table.get("name", kind)
    if not (isinstance(name, str) and is_name(name)):
        expected = "expected small letters, digits, - and _, 63 at most"
        faults.append(f"name: {strict.shown(name)}: {expected}")
    elif name != kind and name in names():
        faults.append(f"name: {name!r}: a kind of board is called so; expected another name")
    else:
        return name
    return kind


def _wired(
    defined: BoardDefinition[Any], settings: BoardSettings, faults: list[str]
) -> tuple[Sequence[Device], Mapping[str, BusLoad]]:
    """The chips on the buses, and what the board asks of each; what is wrong is a fault."""
    with blamed_on(entry_point_of(settings.board), "definition"):
        devices = defined.devices(settings)
        faults += _faults_of(defined, settings, devices)
        loads = {} if faults else defined.loads(settings)
        faults += [sentence for each in loads.values() if (sentence := each.fault())]
    return devices, loads


def _faults_of(
    defined: BoardDefinition[Any],
    settings: BoardSettings,
    devices: Sequence[Device],
) -> list[str]:
    """Return what no single value shows: the same of every board, and its package's own."""
    faults = executive_faults(settings.executive, settings.guard)
    serial_devices, ports = defined.serial_devices(settings), settings.ports
    faults += device_faults(devices, settings.buses, serial_devices, ports)
    faults += [fault for fault in own_faults(defined, settings) if fault not in faults]
    build = None if faults else partial(_built, defined, settings)
    if build is not None and (settings.roles or settings.link != LinkSettings()):
        lines = absent_lines(settings.buses, settings.ports)
        model, optional = build(lines).model, defined.optional_components
        faults += role_faults(settings.roles, settings.link, model, optional)
    return faults + unused_lines(settings, build)


def own_faults(defined: BoardDefinition[Any], settings: BoardSettings) -> Sequence[str]:
    """Return what the package's own hook finds. Raises SettingError if these are no sentences."""
    found = defined.faults(settings)
    if not (isinstance(found, list | tuple) and all(isinstance(each, str) for each in found)):
        raise SettingError(
            f"faults returned {strict.shown(found)}", expected="sentences, in a list"
        )
    return found


def _assigned(assignments: Sequence[str]) -> set[str]:
    """The keys that assignments name, and the tables these are in."""
    keys = [strict.key_path(each.partition("=")[0].strip()) for each in assignments]
    return {".".join(key[:depth]) for key in keys for depth in range(1, len(key) + 1)}


def _built(defined: BoardDefinition[Any], settings: BoardSettings, lines: Lines) -> Robot:
    """The robot that a package builds. Raises ConfigError for whatever goes wrong in it."""
    entry_point = entry_point_of(settings.board)
    with blamed_on(entry_point, "build"), no_collection():
        robot = defined.build(settings, lines)
    if not isinstance(robot, Robot):
        found = f"build returned {type(robot).__name__}"
        raise broken(entry_point, f"{found}; expected a firmware_runtime.board.robot.Robot")
    if (fault := robot.fault()) is not None:
        raise broken(entry_point, f"build: {fault}")
    if not robot.stop and (driving := declaring(robot.model, "drives")):
        fault = f"{', '.join(driving)} may drive, and nothing would switch it off"
        raise broken(entry_point, f"build: stop: {fault}; expected a function for each chip")
    return robot


def _event_model(
    defined: BoardDefinition[Any], settings: BoardSettings
) -> Callable[[Path | None], Component] | None:
    build = defined.event_model
    return None if build is None else lambda model_file: build(settings, model_file)


def _result_text(
    defined: BoardDefinition[Any], settings: BoardSettings
) -> Callable[[Mapping[str, Any]], str] | None:
    if (in_words := defined.result_text) is None:
        return None

    def text(result: Mapping[str, Any]) -> str:
        """Raises ConfigError for whatever goes wrong in it."""
        with blamed_on(entry_point_of(settings.board), "result_text"):
            said = in_words(result)
            if not isinstance(said, str):
                raise SettingError(f"returned {strict.shown(said)}", expected="a sentence")
            return " ".join(said.split())

    return text


def _locate(board: str, known: Sequence[str]) -> Path:
    if board in names():
        return shipped_file(board)
    path = Path(board)
    if os.path.isdir(path):  # noqa: PTH112 -- pathlib's raise for a closed folder or a long name
        path /= FILE
    if os.path.isfile(path):  # noqa: PTH113
        return path
    raise ConfigError(board or "''", [_not_found(board, known)])


def _not_found(board: str, known: Sequence[str]) -> str:
    expected = f"expected one of {', '.join(known)}, or a {FILE} file"
    if not (os.sep in board or Path(board).suffix or os.path.exists(board)):  # noqa: PTH110
        return f"unknown board; {suggested(board, known, expected)}"
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
    except ValueError:
        return "no name of a file (it holds a null byte, or half a character)"
    return "no regular file"
