"""Rigs by board, for a robot that runs on doubles, here or in another process.

Only the board's own rig is imported, by its entry point.
"""

from collections.abc import Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from firmware_runtime.board.installed import blamed_on, broken
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Doubles, Rig
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.errors import ConfigError, SettingError
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.system.packages import EntryPoint, installed

if TYPE_CHECKING:
    from firmware_runtime.hal.served.client import ServedDoubles

T = TypeVar("T")

GROUP = "firmware_runtime.rigs"
_DEMANDED = tuple(name for part in (Doubles, Rig) for name in vars(part) if name[0] != "_")
"""What a rig has, by its protocol; looked up without asking a property for its value."""


def rig_for(board: Board, clock: WireClock) -> Rig:
    """The board's doubles, on their buses and tied to their world, on this clock.

    Raises ConfigError if the board has no rig, for one that is broken, and for a world that cannot
    be, such as a start within a wall.
    """
    entry_point = _entry_point(board)
    if entry_point is None:
        fault = f"{board.kind} has no rig, so it cannot run on doubles; expected an entry point"
        raise ConfigError.of_one(board.name, f"{fault} {board.kind!r} of the group {GROUP}")
    with blamed_on(entry_point, "import"):
        build = entry_point.load()
    with blamed_on(entry_point, "rig"):
        try:
            rig: Rig = build(board.settings, clock)
        except ValueError as error:
            raise ConfigError(str(board.source), [f"world: {error}"]) from error
    if missing := [name for name in _DEMANDED if name not in dir(rig)]:
        raise broken(entry_point, f"no {', '.join(missing)}; see firmware_runtime.board.rig.Rig")
    with blamed_on(entry_point, "rig"):
        _check_lines(rig)
    if bare := [*(board.settings.buses.keys() - rig.buses), *(board.ports.keys() - rig.ports)]:
        raise broken(entry_point, f"no doubles of {', '.join(bare)}; expected all lines of a board")
    return rig


def _check_lines(rig: Rig) -> None:
    """Raise SettingError for lines of a rig that are none."""
    for part, kind in (("buses", I2cBus), ("ports", SerialPort)):
        lines: object = getattr(rig, part)
        if not (isinstance(lines, Mapping) and all(isinstance(e, kind) for e in lines.values())):
            raise SettingError(f"{part} {lines!r}", expected=f"each {kind.__name__} by its name")
    if not isinstance(rig.enable, EnableLine | None):
        raise SettingError(f"enable {rig.enable!r}", expected="an EnableLine or None")


def of_rig(board: Board, part: str, value: Mapping[str, T]) -> dict[str, T]:
    """Return what a part of a rig returned, by names. Raises ConfigError if that is none."""
    with blamed_on_rig(board, part):
        if not isinstance(value, Mapping):
            raise SettingError(f"{value!r}", expected="values by their names")
    return dict(value)


def blamed_on_rig(board: Board, part: str) -> AbstractContextManager[None]:
    """Raise ConfigError for whatever a part of the board's rig raises that is no sentence yet."""
    entry_point = _entry_point(board)
    return nullcontext() if entry_point is None else blamed_on(entry_point, part)


def shown_by(rig: Rig, board: Board) -> OutPort[float] | None:
    """The port that a board's rig shows. Raises ConfigError if that raises, or is none."""
    with blamed_on_rig(board, "shown"):
        port = rig.shown
        if not isinstance(port, OutPort | None):
            raise SettingError(f"{port!r}", expected="an OutPort or None")
    return port


def has_rig(board: Board) -> bool:
    """Return whether the board can run on doubles."""
    return _entry_point(board) is not None


def _entry_point(board: Board) -> EntryPoint | None:
    return next((each for each in installed(GROUP) if each.name == board.kind), None)


def served_doubles(
    board: Board, path: Path, *, alone: bool = True, wait_s: float = 0.0
) -> "ServedDoubles":
    """The board's doubles that are served at a path, which may begin within `wait_s`.

    `alone` keeps out every other process that asks for the same. Raises BusAbsent if there are
    none, BusInUse if another process has them alone, ConfigError if they are another board's.
    """
    # of doubles in another process only
    from firmware_runtime.hal.served.client import ServedDoubles, look  # noqa: PLC0415
    from firmware_runtime.hal.served.connection import Connection  # noqa: PLC0415

    connection = Connection(path, wait_s=wait_s)
    with ExitStack() as undo:
        undo.callback(connection.close)
        if alone:
            connection.keep_others_out()
        served = look(connection.ask).board
        if served != board.name:
            raise ConfigError(board.name, [f"--doubles: {path} serves the doubles of {served}"])
        doubles = ServedDoubles(
            connection.ask,
            board.settings.buses,
            board.ports,
            has_enable_line=board.settings.output_enable is not None,
            disconnect=connection.close,
        )
        undo.pop_all()
    return doubles
