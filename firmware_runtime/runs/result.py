"""What a run gives back to the program that started it."""

from dataclasses import dataclass, field

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.statistics import RunState


@dataclass(frozen=True, slots=True)
class RunResult:
    """How a run ended, or how it stands where it may go on.

    `state` is ENDED (at the requested instant, or nothing was due any more), STOPPED (by a signal,
    on request, or because the robot's task is over), OVERRUN (by a policy, or because the loop
    cannot keep up with the clock) or FAILED (a device was never ready, or the robot's task failed);
    `reason` says it in a sentence.
    """

    state: RunState
    reason: str
    at: int
    """The instant of the run, ns since its start."""
    statistics: Figures = field(repr=False)

    @property
    def at_s(self) -> float:
        """The instant of the run in seconds."""
        return self.at / SECOND
