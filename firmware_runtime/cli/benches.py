"""Which bench stands for which board when a robot runs on doubles."""

from collections.abc import Callable

from boards.registry import Board
from sim_doubles.benches.bench import Bench
from sim_doubles.benches.detective import DetectiveBench
from sim_doubles.benches.tachobot import TachobotBench
from sim_doubles.clock import Now

_BENCHES: dict[str, Callable[..., Bench]] = {
    "detective": DetectiveBench,
    "tachobot": TachobotBench,
}


def bench_for(board: Board, now: Now) -> Bench:
    """The board's doubles, on their buses and tied to their world, on this clock."""
    return _BENCHES[board.name](board.settings, now)
