"""Clocks: what a run takes time from. Real, scaled and virtual time are one loop with three clocks.

A clock counts integer nanoseconds since the start of the run and never goes back. The real ones
read CLOCK_MONOTONIC, which no correction of the wall clock can move. To wait they turn the deadline
into the time left at that moment, so an error of one wait is not carried into the next, and they
never wait longer than `LONGEST_WAIT`: the loop looks around, and shows that it is alive, at least
that often.
"""

from collections.abc import Sequence
from math import inf
from select import select
from time import monotonic_ns
from typing import Protocol, TypeVar

from firmware_runtime.devs.time import MILLISECOND, SECOND

LONGEST_WAIT = 50 * MILLISECOND


class HasDescriptor(Protocol):
    """Something that `select` can wait for."""

    def fileno(self) -> int:
        """The descriptor that becomes readable."""


S = TypeVar("S", bound=HasDescriptor)


class Clock(Protocol):
    """What the loop needs of a clock."""

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
        self._epoch = monotonic_ns()

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        self._epoch = monotonic_ns() - at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return monotonic_ns() - self._epoch

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:
        """Sleep until the deadline, an input, or the longest wait; then spin if asked to."""
        asleep = self._real(until - self.now()) - self.spin
        ready, _, _ = select(sources, (), (), min(max(asleep, 0), LONGEST_WAIT) / SECOND)
        if self.spin > 0 and asleep <= LONGEST_WAIT and not ready:
            while self.now() < until:
                pass
        return ready

    def _real(self, span: int) -> int:
        """Nanoseconds of real time that a span of the run takes."""
        return span


class ScaledClock(MonotonicClock):
    """Real time, `speed` times as fast: at 10, a run of 30 s takes 3 s.

    Raises ValueError unless `speed` is a positive number.
    """

    def __init__(self, speed: float) -> None:
        super().__init__()
        if not 0 < speed < inf:
            raise ValueError(f"scaled clock: speed {speed}, expected a positive number")
        self._gained, self._spent = speed.as_integer_ratio()
        self._at = 0

    def start(self, at: int) -> None:
        """From this moment on, count from `at`."""
        super().start(0)
        self._at = at

    def now(self) -> int:
        """Return the present instant of the run, in ns."""
        return self._at + super().now() * self._gained // self._spent

    def _real(self, span: int) -> int:
        return -(-span * self._spent // self._gained)


class VirtualClock:
    """Virtual time: a wait is over at once, and time stands still while anything is done.

    Never, too, is reached at once: a run without an end is over when nothing is due any more.
    """

    def __init__(self) -> None:
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
