"""Pace of a topic: at most so many messages a second, and the newest is never left out.

By the instants of the run, which have no jitter: of samples at 100 Hz every second goes out at
50 Hz, as soon as it comes. One that came too early is published all the same where no other follows
it: the last command, the last reading.
"""

from typing import Generic, TypeVar

from firmware_runtime.devs.time import NEVER, SECOND

M = TypeVar("M")


class Pace(Generic[M]):
    """Lets a message through when one is due, and keeps the newest of those that came early.

    `due_at` is when the one that is kept is to go, in ns of the caller's clock. With a rate of 0
    none is kept.
    """

    def __init__(self, rate_hz: float) -> None:
        self.period = round(SECOND / rate_hz) if rate_hz > 0 else 0
        self.due_at = NEVER
        self._next_t = 0
        self._kept: M | None = None

    def take(self, message: M, t_ns: int, now: int) -> M | None:
        """The message of the instant `t_ns`, if one is due; else it is kept, not the one before."""
        early = self._next_t - t_ns
        if not 0 < early <= self.period:  # a run that begins again is far too early
            on_grid = self._next_t + self.period
            self._next_t = on_grid if t_ns < on_grid <= t_ns + self.period else t_ns + self.period
            self._kept, self.due_at = None, NEVER
            return message
        self._kept = message
        self.due_at = now + early + self.period
        return None

    def late(self, now: int) -> M | None:
        """The message that was kept, if no other came in its time."""
        if now < self.due_at:
            return None
        kept, self._kept, self.due_at = self._kept, None, NEVER
        return kept
