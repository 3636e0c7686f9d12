"""Gains and limits, read again while the robot runs: an hook that waits for SIGHUP."""

from collections.abc import Callable
from dataclasses import replace

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import changed_keys, need_restart, retuned
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.loop import Executive
from firmware_runtime.system.notices import Notices

NEEDED = 5 * MILLISECOND
"""Ns that reading a board's file may take; 1.3 ms on a PC."""
PATIENCE = SECOND
"""Ns after which it is read all the same: a fast loop never has that much time."""


class Reloading:
    """Reads the board's file again on request, between two steps that are far enough apart.

    A file with any fault changes nothing. What only a new run can take up is named and left as it
    is. `log` gets the result, a sentence.
    """

    def __init__(
        self,
        board: Board,
        robot: Robot,
        executive: Executive,
        notices: Notices,
        log: Callable[[str], None],
    ) -> None:
        self._board = board
        self._robot = robot
        self._executive = executive
        self._notices = notices
        self._log = log
        self._is_asked = False
        self._at_latest = 0
        executive.hooks.append(self)

    def request(self) -> None:
        """Read it again after the step under way; safe in a signal handler."""
        self._at_latest = self._executive.clock.now() + PATIENCE
        self._is_asked = True
        self._executive.inbox.wake()

    def attend(self, now: int, left: int) -> None:
        """Reload on request, as soon as it makes no activation late."""
        if self._is_asked and (left >= NEEDED or now >= self._at_latest):
            self._is_asked = False
            self._notices.reloading()
            self._log(self._reload())
            self._notices.ready()

    def _reload(self) -> str:
        try:
            board = registry.load(str(self._board.source), self._board.assignments)
        except Exception as error:  # noqa: BLE001 -- whatever the file holds, the run goes on
            said = error if isinstance(error, ConfigError) else f"{type(error).__name__}: {error}"
            return f"not reloaded, everything stays as it was: {said}"
        if (board.name, board.kind) != (self._board.name, self._board.kind):
            now = f"{board.source} is now {board.name}, a {board.kind}"
            return f"not reloaded, everything stays as it was: {now}"
        before = self._board.settings
        changed = list(changed_keys(before, board.settings))
        left = need_restart(changed, board.retunable)
        taken = [key for key in changed if key not in left]
        # nothing else: channels that are not written any more would keep their last duties
        settings = retuned(before, board.settings, board.retunable)
        self._robot.retune(settings)
        self._board = replace(board, settings=settings)
        parts = [f"reloaded {self._board.source}: {', '.join(taken) or 'nothing new'}"]
        if left:
            parts.append(f"only a new run takes up {', '.join(left)}")
        return "; ".join(parts)
