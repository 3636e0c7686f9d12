"""What a robot is to do: when it is over the run ends."""

from firmware_runtime.board.ending import Ending
from firmware_runtime.board.robot import Robot
from firmware_runtime.executive.executive import Executive


class Task:
    """Of one run. `ending` is how it was over, once it is."""

    def __init__(self, executive: Executive, robot: Robot) -> None:
        self.ending: Ending | None = None
        self._executive = executive
        self._ends_on_failure = robot.ends_on_failure
        if robot.ended is not None:
            executive.simulator.listen(robot.ended, self._hear)

    @property
    def has_failed(self) -> bool:
        """Whether it is over because something went wrong."""
        return self.ending is not None and self.ending.failed

    def end_with(self, ending: Ending) -> None:
        """End the run: its task is over, here or at the other end."""
        self.ending = ending
        self._executive.request_stop(ending.reason)

    def _hear(self, _at: int, ending: Ending) -> None:
        if self._ends_on_failure or not ending.failed:
            self.end_with(ending)
