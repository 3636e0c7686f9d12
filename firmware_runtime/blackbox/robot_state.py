"""The state of a robot in a run: its model and drivers, and the executive that runs them."""

from collections.abc import Iterable

from firmware_runtime.blackbox.keyframes import StateTable
from firmware_runtime.board.lines import absent_lines
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.engine import Engine
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.loop import Executive
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.spans import SpanRing

EDGES = (Executive, MonotonicClock, VirtualClock, Inbox, StatisticsFile, SpanRing, GarbageTime)
"""What stands at the edge of every run. The file of its statistics is kept as far as models, buses
and the like count in it, without what it says of the run as a whole."""


def robot_state(robot: Robot, executive: Executive, edges: Iterable[object] = ()) -> StateTable:
    """The table of a robot's run; `edges` are its lines, its session, and a world's models.

    To be made when the run has begun, before its first step: in the first call of a hook. Where
    counters are kept is settled then. Raises UnkeepableState.
    """
    roots = {"robot": robot, **executive.state}
    return StateTable(roots, (*EDGES, executive.cells, *edges))


def world_models(board: Board, model: Coupled, engine: Engine) -> list[object]:
    """The models that a rig has attached to a board's model, whole and every atomic in them."""
    own = board.build(absent_lines(board.settings.buses, board.ports)).model.components
    attached = {name: each for name, each in model.components.items() if name not in own}
    atomics = [each for each in engine.atomics if _component(each.path) in attached]
    return [*attached.values(), *atomics]


def _component(path: str) -> str:
    """The name after the root's: `controller` of `tachobot.controller.yaw`."""
    return path.partition(".")[2].partition(".")[0]
