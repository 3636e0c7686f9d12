"""Switches the outputs of a run off, and knows whether they are."""

from pathlib import Path

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.errors import text_of
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.run_settings import DrivenBy


class SwitchingOff:
    """By the line that enables outputs, if there is one, and by every chip that drives.

    What may be on when this process is gone is said beside its statistics, by the settings that it
    is driven by, until it is off; `statistics` is None for a run that keeps none.
    """

    def __init__(
        self, board: Board, hardware: Hardware, edge: RecordedEdge, statistics: Path | None
    ) -> None:
        self._hardware = hardware
        self._edge = edge
        self._driven_by = DrivenBy(board, statistics if hardware.is_outside else None)
        self._is_off = False  # by the last attempt

    def leave_word(self) -> None:
        """Say how to switch off what the run will drive. Raises StatisticsFileError."""
        self._driven_by.keep()

    def leave_no_word(self) -> None:
        """However the run ended, nothing has to be switched off any more that is off."""
        if self._is_off:
            self._driven_by.forget()

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
        """Switch off what no run will: a bring-up may have left something on.

        Returns what failed, one sentence each.
        """
        return [] if self._is_off else self.all_of(robot)
