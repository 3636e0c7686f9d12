"""A board's outputs, held by a process that runs no model: all it can do is switch them off."""

from pathlib import Path

from boards.lines import Lines
from boards.registry import Board
from boards.robot import Robot
from firmware_runtime.cli.lines import close_lines, reach_lines, served_doubles
from firmware_runtime.hal.errors import HalError
from firmware_runtime.hal.linux_node import check_node


class Outputs:
    """Opens the board's buses when they are needed, and anew after every failure.

    A bus that cannot be opened keeps no other from being written to.
    `doubles` is where they are served, None on the real robot. Nothing is locked: whoever drives
    the outputs at the time cannot keep us out.
    """

    def __init__(self, board: Board, doubles: Path | None) -> None:
        self._board = board
        self._doubles = doubles
        self._opened: tuple[Lines, Robot] | None = None

    def reach(self) -> None:
        """Raise HalError where a real bus or port could not be opened if it were needed now."""
        if self._doubles is None:
            for name, line in (self._board.settings.buses | self._board.ports).items():
                check_node(name, line.device)

    def make_safe(self) -> list[str]:
        """Write full-off to every chip; return what failed, one sentence each."""
        try:
            failed = self._robot().make_safe()
        except HalError as error:
            failed = [str(error)]
        if failed:
            self.close()
        return failed

    def close(self) -> None:
        """Release the buses."""
        if self._opened is not None:
            close_lines(self._opened[0])
            self._opened = None

    def _robot(self) -> Robot:
        if self._opened is None:
            doubles = None
            if self._doubles is not None:
                doubles = served_doubles(self._board, self._doubles, alone=False)
            lines = reach_lines(self._board, doubles)
            self._opened = lines, self._board.build(lines)
        return self._opened[1]
