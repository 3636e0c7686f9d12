"""A clock for a test that no time passes on, but `time.sleep` and what goes over a bus.

    def test_it_waits_for_the_conversion(virtual_time):
        driver.measure()                        # sleeps 0.1 s, in no time
        assert virtual_time.now_s >= 0.1

`sleep` moves the clock on and returns. Reading the clock takes a microsecond, so that a loop
which waits by polling it ends. Threads are not kept in step: a `sleep` in any of them moves the one
clock. Waiting for an event, a lock or a socket is in real time.
"""

import threading
import time
from collections.abc import Callable
from typing import Final

import pytest

from sim_doubles.clock import FollowingClock
from sim_doubles.testing.substitution import substitute

MICROSECOND: Final = 1_000
SECOND: Final = 1_000_000_000
POWERED_FOR: Final = 100_000_000
"""Begin of a test's clock, ns: chips that the test connects have had power since 0."""
STARTS_AT: Final = 1_767_225_600 * SECOND
"""`time.time` at the start of a test: the beginning of 2026, UTC."""


class VirtualTime:
    """The instant in ns since chips had power; the clock of doubles, of `time` too."""

    def __init__(self) -> None:
        self._at = POWERED_FOR
        self._lock = threading.Lock()
        self.settles: list[Callable[[], None]] = []
        """Called before and after a sleep: what is under way on a pty arrives when it was sent."""

    def __call__(self) -> int:
        """Return the instant; takes no time."""
        return self._at

    @property
    def now_s(self) -> float:
        """The time in s since the start of the test."""
        return (self._at - POWERED_FOR) / SECOND

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""
        with self._lock:
            self._at = max(self._at, at)

    def advance(self, span: int) -> None:
        """Let `span` ns pass. Raises ValueError when it is negative."""
        if span < 0:
            raise ValueError(f"virtual time: advanced by {span} ns, expected 0 or more")
        with self._lock:
            self._at += span

    def sleep(self, secs: float) -> None:
        """Let that many seconds pass, as `time.sleep`. Raises ValueError when it is negative."""
        if secs < 0:
            raise ValueError("sleep length must be non-negative")
        self._settle()
        self.advance(round(secs * SECOND))
        self._settle()

    def _settle(self) -> None:
        for settle in self.settles:
            settle()

    def look(self) -> int:
        """Return the instant, after the microsecond that reading takes."""
        self.advance(MICROSECOND)
        return self._at

    def functions(self) -> dict[Callable[..., object], Callable[..., object]]:
        """Return the replacement of each function of `time`."""
        return {
            time.sleep: self.sleep,
            time.monotonic: lambda: self.look() / SECOND,
            time.monotonic_ns: self.look,
            time.perf_counter: lambda: self.look() / SECOND,
            time.perf_counter_ns: self.look,
            time.time: lambda: (STARTS_AT + self.look()) / SECOND,
            time.time_ns: lambda: STARTS_AT + self.look(),
        }

    def rule(self, patch: pytest.MonkeyPatch) -> None:
        """Be the time of `time`, and of every driver, until the patch is undone."""
        functions = self.functions()
        substitute(patch, functions)
        for theirs, ours in functions.items():
            patch.setattr(time, theirs.__name__, ours)


def running_time() -> FollowingClock:
    """Return CLOCK_MONOTONIC since chips had power, before the test; a bus runs ahead of it."""
    monotonic_ns = time.monotonic_ns
    started_at = monotonic_ns() - POWERED_FOR
    return FollowingClock(lambda: monotonic_ns() - started_at)
