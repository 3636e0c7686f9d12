"""Gains and limits, read again while the robot runs: a hook that waits for SIGHUP."""

from collections.abc import Callable

from firmware_runtime.board import registry
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.system.messages import Notices

NEEDED = 5 * MILLISECOND
"""Ns that reading a board's file may take; 1.3 ms on a PC."""
TIMEOUT = SECOND
"""Ns after which it is read all the same: a fast loop never has that much time."""


class Reloading:
    """Reads the board's file again on request, between two steps that are far enough apart.

    A file with any fault changes nothing. What only a new run can take up is named and left as it
    is. `log` gets the result, a sentence.
    """

    def __init__(
        self,
        tuning: Tuning,
        executive: Executive,
        notices: Notices,
        log: Callable[[str], None],
    ) -> None:
        self._tuning = tuning
        self._executive = executive
        self._notices = notices
        self._log = log
        self._is_asked = False
        self._at_latest = 0
        executive.hooks.append(self)

    def request(self) -> None:
        """Read it again after the step under way; safe in a signal handler."""
        self._at_latest = self._executive.clock.now() + TIMEOUT
        self._is_asked = True
        self._executive.inbox.wake()

    def between_steps(self, now: int, left: int) -> None:
        """Reload on request, as soon as it makes no activation late."""
        if self._is_asked and (left >= NEEDED or now >= self._at_latest):
            self._is_asked = False
            self._notices.reloading()
            self._log(self._reload())
            self._notices.ready()

    def _reload(self) -> str:
        own = self._tuning.board
        try:
            board = registry.load(str(own.source), own.assignments)
        except Exception as error:  # noqa: BLE001 -- whatever the file holds, the run goes on
            said = error if isinstance(error, ConfigError) else f"{type(error).__name__}: {error}"
            return f"not reloaded, everything stays as it was: {said}"
        if (board.name, board.kind) != (own.name, own.kind):
            now = f"{board.source} is now {board.name}, a {board.kind}"
            return f"not reloaded, everything stays as it was: {now}"
        try:
            taken, left = self._tuning.take_up(board.settings)
        except ConfigError as error:
            return f"not reloaded, everything stays as it was: {error}"
        parts = [f"reloaded {own.source}: {', '.join(taken) or 'nothing new'}"]
        if left:
            parts.append(f"only a new run takes up {', '.join(left)}")
        return "; ".join(parts)
