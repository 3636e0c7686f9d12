"""The operator of a script of faults: disarms a run on doubles, and arms it again."""

from bisect import insort
from typing import TYPE_CHECKING

from firmware_runtime.devs.time import NEVER

if TYPE_CHECKING:
    from firmware_runtime.executive.executive import Executive
    from firmware_runtime.runs.arming import Arming


class ScriptedOperator:
    """Carries its commands out between two steps of the run, once it attends one, as a hook."""

    def __init__(self) -> None:
        self._commands: list[tuple[int, bool]] = []
        """Instants, ns of the run, and whether it is to be armed; in order."""
        self._executive: Executive | None = None
        self._arming: Arming | None = None

    def attend(self, executive: "Executive", arming: "Arming") -> None:
        """Give the commands to this run."""
        self._executive, self._arming = executive, arming
        executive.hooks.append(self)

    def disarm(self, at: int, until: int) -> None:
        """Have it disarmed at an instant, and armed again at another, if that is not NEVER."""
        insort(self._commands, (at, False))
        self.arm(until)

    def arm(self, at: int) -> None:
        """Have it armed at an instant."""
        if at != NEVER:
            insort(self._commands, (at, True))

    def between_steps(self, now: int, _left: int) -> None:
        """Carry out what is due."""
        assert self._executive is not None  # noqa: S101 -- it attends one
        assert self._arming is not None  # noqa: S101
        while self._commands and self._commands[0][0] <= now:
            _, is_armed = self._commands.pop(0)
            if is_armed:
                self._arming.is_wanted = True  # as soon as nothing speaks against it
            else:
                self._arming.disarm("its operator disarmed it")
        if self._commands:
            self._executive.poll_by(self._commands[0][0])
