"""Which rig stands for which board when a robot runs on doubles, here or in another process.

Only the board's own rig is imported, by its entry point.
"""

from pathlib import Path

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.entry_points import installed
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.hal.served.client import ServedDoubles, look
from firmware_runtime.hal.served.connection import Connection

GROUP = "firmware_runtime.rigs"


def rig_for(board: Board, clock: WireClock) -> Rig:
    """The board's doubles, on their buses and tied to their world, on this clock.

    Raises ConfigError if the board has no rig, or for a world that cannot be, such as a start
    within a wall.
    """
    for entry_point in installed(GROUP):
        if entry_point.name == board.kind:
            try:
                rig: Rig = entry_point.load()(board.settings, clock)
            except ValueError as error:
                raise ConfigError(str(board.source), [f"world: {error}"]) from error
            return rig
    fault = f"{board.kind} has no rig, so it cannot run on doubles; expected an entry point"
    raise ConfigError(board.name, [f"{fault} {board.kind!r} of the group {GROUP}"])


def has_rig(board: Board) -> bool:
    """Whether the board can run on doubles."""
    return any(entry_point.name == board.kind for entry_point in installed(GROUP))


def served_doubles(board: Board, path: Path, *, alone: bool = True) -> ServedDoubles:
    """The board's doubles that are served at a path.

    `alone` keeps out every other process that asks for the same. Raises BusAbsent if there are
    none, BusInUse if another process has them alone, ConfigError if they are another board's.
    """
    connection = Connection(path)
    if alone:
        connection.keep_others_out()
    served = look(connection.ask).board
    if served != board.name:
        connection.close()
        raise ConfigError(board.name, [f"--doubles: {path} serves the doubles of {served}"])
    return ServedDoubles(
        connection.ask,
        board.settings.buses,
        board.ports,
        has_enable_line=board.settings.output_enable is not None,
    )
