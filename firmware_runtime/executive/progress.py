"""Whether logical time keeps up with the clock, and when it does so no longer.

A step that ends is no sign of life: a model with a time advance of 1 ns ends steps without end, and
no other event comes to its turn. What counts is how far logical time is behind: the lag, the time
since the next event was due.

A run is in a livelock when it has been behind for `max_lag` of stepping without ever having caught
up, and its lag has not become less meanwhile. A step counts for a hundredth of that at most: a
machine that stands still, or a bus that hangs, is no livelock, and takes a hundred steps to pass
for one. A loop that catches up with what a stall has left has less lag from step to step.
"""

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.account import Step

_STEPS = 100
"""The least number of steps of a livelock."""


class Progress:
    """Follows the lag from step to step; spans are real time, instants the run's.

    `speed` is how many times as fast as real time the run's clock goes; virtual time, of speed 0,
    is behind by what it was stalled. `livelock` says why the run must end; it is empty until then.
    """

    def __init__(self, step: Step, max_lag: int, speed: float) -> None:
        self.lag = 0
        self.livelock = ""
        self.is_level = False
        """Whether logical time had caught up after the last step, so that there is nothing to note
        if it has again."""
        self._step = step
        self._max_lag = max_lag
        self._speed = speed or 1.0
        self._limit = round(max_lag * self._speed)
        self._has_caught_up = False
        self._is_behind = False
        self._behind_for = 0
        self._lag_then = 0
        self._previous_end = 0
        self._activations: list[int] = []

    @property
    def keeps_up(self) -> bool:
        """Whether the lag after the last step is within the limit."""
        return self.lag <= self._max_lag

    def note(self, ended: int, next_at: int) -> int:
        """A step has ended and the next event is due at `next_at`: return the lag.

        Until logical time has caught up once there is none: a slow bring-up is no hang.
        """
        lag = ended - next_at
        if lag <= 0:
            self.idle()
            return 0
        self.is_level = False
        if self._has_caught_up:
            self.lag = lag if self._speed == 1 else round(lag / self._speed)
        self._follow(ended, lag)
        return self.lag

    def idle(self) -> None:
        """Logical time has caught up."""
        self.is_level = self._has_caught_up = True
        self._is_behind = False
        self.lag = 0

    def _follow(self, ended: int, lag: int) -> None:
        """Add up the time behind, and see whether the limit is reached."""
        if not self._is_behind:
            self._is_behind = True
            self._begin(lag)
        else:
            self._behind_for += min(ended - self._previous_end, self._limit // _STEPS)
            self._count()
            if self._behind_for > self._limit:
                if lag >= self._lag_then:
                    self._end(lag)
                self._begin(lag)
        self._previous_end = ended

    def _begin(self, lag: int) -> None:
        self._behind_for = 0
        self._lag_then = lag
        self._activations = [0] * len(self._step.paths)

    def _count(self) -> None:
        """Count the models whose output function ran in this step."""
        started = self._step.started
        for number, began_at in enumerate(self._step.began_at):
            if began_at >= started:
                self._activations[number] += 1

    def _end(self, lag: int) -> None:
        most = max(self._activations)
        path = self._step.paths[self._activations.index(most)]
        limit_s, lag_ms = self._max_lag / SECOND, lag / self._speed / MILLISECOND
        self.livelock = (
            f"logical time does not keep up: {limit_s:g} s of stepping without having caught up "
            f"with the clock, {lag_ms:.1f} ms behind it; {path} ran most, {most} times"
        )
