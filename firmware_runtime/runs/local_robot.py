"""The robot that runs in this process, on its lines: the whole of a board, or one end of it."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from firmware_runtime.board.configuration import input_timeouts
from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.ports import InPort
from firmware_runtime.errors import text_of
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.outputs import forget_settings, keep_settings
from firmware_runtime.runs.recorded_edge import RecordedEdge

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd
    from firmware_runtime.devs.part import Part
    from firmware_runtime.links.ports.ports import Ports


class LocalRobot(Struct, frozen=True):
    """A robot on its lines: its part of the whole, its ports for others, how it is switched off."""

    robot: Robot
    hardware: Hardware
    part: "Part | None"
    """None where the whole board runs here."""
    ports: "Ports | None"
    timeouts: dict[InPort[Any], int]
    """Ns of silence that are noticed, by input port; those that hold their value are left out."""
    switching_off: "SwitchingOff"

    def make_safe(self) -> list[str]:
        """Switch all outputs off; return what failed, one sentence each."""
        return self.switching_off.all_of(self.robot)


def local_robot(  # noqa: PLR0913 -- put together once, by the start
    board: Board,
    hardware: Hardware,
    end: "BoardEnd | None",
    edge: RecordedEdge,
    statistics: Path | None,
    *,
    has_ports: bool,
) -> LocalRobot:
    """Build the robot, and tie the world of its doubles to it. Raises ConfigError."""
    whole = board.build(hardware.lines)
    ports = _ports_of(whole) if has_ports else None  # the world's own are none of them
    edge.own(whole.model)
    hardware.attach(whole)
    timeouts = input_timeouts(board, whole)
    robot, part = whole, None
    if end is not None:
        from firmware_runtime.board.ends import other_end, robot_of  # noqa: PLC0415 -- few runs

        robot, part = robot_of(end, whole)
        if ports is not None:
            ports = ports.of_part(part, other_end(board, end).name)
    in_ports = robot.model.in_ports
    noticed = {
        in_ports[name]: ns for name, ns in timeouts.items() if ns is not None and name in in_ports
    }
    switching_off = SwitchingOff(board, hardware, edge, statistics)
    return LocalRobot(robot, hardware, part, ports, noticed, switching_off)


def _ports_of(robot: Robot) -> "Ports":
    from firmware_runtime.links.ports.ports import Ports  # noqa: PLC0415 -- none in virtual time

    return Ports(robot.model)


class SwitchingOff:
    """Switches outputs off, by the line that enables them, if there is one, and by every chip.

    Until all are off, the settings that the outputs are driven by are kept beside the `statistics`,
    where outputs outlive this process; None for a run that keeps none.
    """

    def __init__(
        self, board: Board, hardware: Hardware, edge: RecordedEdge, statistics: Path | None
    ) -> None:
        self._board = board
        self._hardware = hardware
        self._edge = edge
        self._statistics = statistics if hardware.is_outside else None
        self._is_off = False
        """What the last attempt came to."""

    def keep_settings(self) -> None:
        """Keep what the outputs will be driven by. Raises StatisticsFileError."""
        if self._statistics is not None:
            keep_settings(self._board, self._statistics)

    def forget_settings(self) -> None:
        """Remove what was kept, if all outputs are off, however the run ended."""
        if self._is_off:
            forget_settings(self._statistics)

    def all_of(self, robot: Robot) -> list[str]:
        """Disable all outputs at once where a line can, then write full-off to every chip.

        Returns what failed, one sentence each.
        """
        failed: list[str] = []
        try:
            self._hardware.enable(enabled=False)
        except HalError as error:
            failed.append(text_of(error))
        with self._edge.section(Kind.SAFE):
            failed += robot.make_safe()
        self._is_off = not failed
        return failed

    def before_a_run(self, robot: Robot) -> list[str]:
        """Switch off what a bring-up may have left on, where no run will; return what failed."""
        return [] if self._is_off else self.all_of(robot)
