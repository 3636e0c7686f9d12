"""Which bench stands for which board when a robot runs on doubles, here or in another process."""

from collections.abc import Callable
from pathlib import Path

from boards.registry import Board
from firmware_runtime.errors import BoardError
from sim_doubles.benches.bench import Bench
from sim_doubles.benches.detective import DetectiveBench
from sim_doubles.benches.tachobot import TachobotBench
from sim_doubles.clock import Now
from sim_doubles.served.client import ServedDoubles, look
from sim_doubles.served.connection import Connection

_BENCHES: dict[str, Callable[..., Bench]] = {
    "detective": DetectiveBench,
    "tachobot": TachobotBench,
}


def bench_for(board: Board, now: Now) -> Bench:
    """The board's doubles, on their buses and tied to their world, on this clock."""
    return _BENCHES[board.name](board.settings, now)


def served_doubles(board: Board, path: Path) -> ServedDoubles:
    """The board's doubles that are served at a path.

    Raises BusAbsent if there are none, BoardError if they are another board's.
    """
    connection = Connection(path)
    served = look(connection.ask).board
    if served != board.name:
        connection.close()
        raise BoardError(board.name, [f"--doubles: {path} serves the doubles of {served}"])
    return ServedDoubles(connection.ask, board.settings.buses, board.ports)
