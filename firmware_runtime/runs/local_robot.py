"""The robot that runs in this process: the whole of a board, or one end of it."""

from typing import TYPE_CHECKING, Any

from msgspec import Struct

from firmware_runtime.board.ends import BoardEnd, other_end, robot_of
from firmware_runtime.board.inputs import input_timeouts
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.part import Part
from firmware_runtime.devs.ports import InPort
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.recorded_edge import RecordedEdge

if TYPE_CHECKING:
    from firmware_runtime.links.ports.ports import Ports


class RobotHere(Struct, frozen=True):
    """A robot on its lines, which part of the whole it is, and its ports for others, if any."""

    robot: Robot
    part: Part | None
    ports: "Ports | None"
    timeouts: dict[InPort[Any], int]
    """Of its input ports where silence is to be noticed, ns."""


def robot_here(
    board: Board,
    hardware: Hardware,
    end: BoardEnd | None,
    edge: RecordedEdge,
    *,
    has_ports: bool,
) -> RobotHere:
    """Build it, and tie the world of its doubles to it. Raises ConfigError."""
    whole = board.build(hardware.lines)
    ports = _ports_of(whole) if has_ports else None  # the world's own are none of them
    edge.own(whole.model)
    hardware.attach(whole)
    timeouts = input_timeouts(board, whole)
    robot, part = (whole, None) if end is None else robot_of(end, whole)
    if ports is not None and end is not None and part is not None:
        ports = ports.of_part(part, other_end(board, end).name)
    in_ports = robot.model.in_ports
    here = {
        in_ports[name]: ns for name, ns in timeouts.items() if ns is not None and name in in_ports
    }
    return RobotHere(robot, part, ports, here)


def _ports_of(robot: Robot) -> "Ports":
    from firmware_runtime.links.ports.ports import Ports  # noqa: PLC0415 -- none in virtual time

    return Ports(robot.model)
