"""Time for a chip that is tried out: it passes when it is waited for, and not otherwise."""

from firmware_runtime.devs.time import NEVER
from sim_doubles.clock import ManualClock


class TrialPace:
    """The doubles' clock, and a stop that comes at an instant."""

    def __init__(self, stop_at: int = NEVER) -> None:
        self.clock = ManualClock(1_000_000_000)
        self._stop_at = stop_at

    def now(self) -> int:
        return self.clock()

    def wait(self, span: int) -> bool:
        stops = self.clock() + span >= self._stop_at
        self.clock.advance(min(span, max(self._stop_at - self.clock(), 0)))
        return stops
