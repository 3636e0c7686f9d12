"""Clocks: what a run takes time from. Real, scaled and virtual time are one loop with three clocks.

A clock counts integer nanoseconds since the start of the run and never goes back. The real ones
read CLOCK_MONOTONIC, which no correction of the wall clock can move. They sleep in one `select` for
all sources and for an alarm at the deadline itself, not after the time left: nothing is rounded,
and what passes before the sleep begins does not prolong it. No sleep is longer than `LONGEST_WAIT`:
the loop looks around, and shows that it is alive, at least that often.
"""

from collections.abc import Sequence
from math import inf
from select import select
from time import monotonic_ns
from typing import Any, Protocol, TypeVar

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.alarm import Alarm

LONGEST_WAIT = 50 * MILLISECOND


class HasDescriptor(Protocol):
    """Something that `select` can wait for."""

    def fileno(self) -> int:
        """The descriptor that becomes readable."""


S = TypeVar("S", bound=HasDescriptor)


class Clock(Protocol):
    """What the loop needs of a clock."""

    @property
    def speed(self) -> float:
        """How many times as fast as CLOCK_MONOTONIC it goes; 0 if only when the loop waits."""

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""

    def now(self) -> int:
        """Return the present instant of the run, in ns."""

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Let time pass to `until` at most; return early with the sources that became readable.

        May also return early with none; the loop then looks at the time and waits again.
        """


class MonotonicClock:
    """Real time, from CLOCK_MONOTONIC.

    The last `spin` ns before a deadline are spent looking at the clock instead of asleep: closer to
    the deadline than the kernel wakes a sleeper, at the price of the processor time.
    """

    def __init__(self) -> None:
        self.spin = 0
        self.speed: float = 1
        self._epoch = monotonic_ns()
        self._alarm = Alarm()

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        self._epoch = monotonic_ns() - at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return monotonic_ns() - self._epoch

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Sleep until the deadline, an input, or the longest wait; then spin if asked to."""
        due = self._monotonic(until)
        wake_at = due - self.spin
        left = wake_at - monotonic_ns()
        if left > LONGEST_WAIT:
            return self._sleep(wake_at - left + LONGEST_WAIT, sources)
        ready = self._sleep(wake_at, sources) if left > 0 else select(sources, (), (), 0)[0]
        if self.spin > 0 and not ready:
            while monotonic_ns() < due:
                pass
        return ready

    def _sleep(self, wake_at: int, sources: Sequence[S]) -> list[S]:
        """Sleep until a source is readable, or the instant of CLOCK_MONOTONIC has come."""
        self._alarm.set(wake_at)
        anything: list[Any] = [*sources, self._alarm]
        ready, _, _ = select(anything, (), ())
        if ready[-1] is self._alarm:
            ready.pop()
        return ready

    def _monotonic(self, at: int) -> int:
        """The instant of CLOCK_MONOTONIC, or the first one, at which an instant of the run is."""
        return self._epoch + at


class ScaledClock(MonotonicClock):
    """Real time, `speed` times as fast: at 10, a run of 30 s takes 3 s.

    Raises ValueError unless `speed` is a positive number.
    """

    def __init__(self, speed: float) -> None:
        super().__init__()
        if not 0 < speed < inf:
            raise ValueError(f"scaled clock: speed {speed}, expected a positive number")
        self.speed = speed
        self._gained, self._spent = speed.as_integer_ratio()
        self._at = 0

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        super().start(0)
        self._at = at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return self._at + super().now() * self._gained // self._spent

    def _monotonic(self, at: int) -> int:
        # rounded up: a deadline is never early
        return self._epoch - (self._at - at) * self._spent // self._gained


class VirtualClock:
    """Virtual time: a wait is over at once, and time stands still while anything is done.

    Never, too, is reached at once: a run without an end is over when nothing is due any more.
    """

    def __init__(self) -> None:
        self.speed: float = 0
        self._now = 0

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        self._now = at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return self._now

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Go to `until`, unless a source is readable now."""
        ready, _, _ = select(sources, (), (), 0)
        if not ready:
            self._now = max(self._now, until)
        return ready
