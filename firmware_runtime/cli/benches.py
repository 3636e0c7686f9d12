"""Which bench stands for which board when a robot runs on doubles, here or in another process.

Only the board's own bench is imported.
"""

from importlib import import_module
from pathlib import Path

from boards.registry import Board
from firmware_runtime.errors import BoardError
from sim_doubles.benches.bench import Bench
from sim_doubles.clock import WireClock
from sim_doubles.served.client import ServedDoubles, look
from sim_doubles.served.connection import Connection

_BENCHES = {"detective": "DetectiveBench", "tachobot": "TachobotBench"}
"""Classes by board; a board's module in `sim_doubles.benches` has its name."""


def bench_for(board: Board, clock: WireClock) -> Bench:
    """The board's doubles, on their buses and tied to their world, on this clock.

    Raises BoardError for a world that cannot be, such as a start within a wall.
    """
    module = import_module(f"sim_doubles.benches.{board.name}")
    try:
        bench: Bench = getattr(module, _BENCHES[board.name])(board.settings, clock)
    except ValueError as error:
        raise BoardError(str(board.source), [f"world: {error}"]) from error
    return bench


def served_doubles(board: Board, path: Path, *, alone: bool) -> ServedDoubles:
    """The board's doubles that are served at a path.

    `alone` keeps out every other process that asks for the same. Raises BusAbsent if there are
    none, BusInUse if another process has them alone, BoardError if they are another board's.
    """
    connection = Connection(path)
    if alone:
        connection.keep_others_out()
    served = look(connection.ask).board
    if served != board.name:
        connection.close()
        raise BoardError(board.name, [f"--doubles: {path} serves the doubles of {served}"])
    return ServedDoubles(
        connection.ask,
        board.settings.buses,
        board.ports,
        has_enable_line=board.settings.output_enable is not None,
    )
