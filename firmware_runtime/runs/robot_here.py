"""The robot that runs in this process: the whole of a board, or one end of it."""

from typing import NamedTuple

from firmware_runtime.board.ends import BoardEnd, other_end
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.board.robot_of_end import robot_of
from firmware_runtime.devs.part import Part
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.recorded_edge import RecordedEdge


class RobotHere(NamedTuple):
    """A robot on its lines, which part of the whole it is, and its ports for others."""

    robot: Robot
    part: Part | None
    ports: Ports


def robot_here(
    board: Board, hardware: Hardware, end: BoardEnd | None, edge: RecordedEdge
) -> RobotHere:
    """Build it, and tie the world of its doubles to it. Raises ConfigError."""
    whole = board.build(hardware.lines)
    ports = Ports(whole.model)  # the world's own are none of them
    edge.own(whole.model)
    hardware.attach(whole)
    if end is None:
        return RobotHere(whole, None, ports)
    robot, part = robot_of(end, whole)
    return RobotHere(robot, part, ports.of_part(part, other_end(board, end).name))
