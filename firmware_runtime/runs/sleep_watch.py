"""A machine that slept (was suspended) with a run on it: the run is disarmed when it goes on.

CLOCK_MONOTONIC stands still meanwhile, so nothing was late and no command is old, though the robot
drove on, or did not, for hours. CLOCK_BOOTTIME goes on: the distance between the two grows by each
sleep and by nothing else. Source: clock_gettime(2).
"""

from time import CLOCK_BOOTTIME, clock_gettime_ns, monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.arming import Arming

SHORTEST: Final = MILLISECOND
"""Ns: no machine goes to sleep and wakes up sooner."""


def watch_sleep(executive: Executive, arming: Arming) -> None:
    """Have a run in real time notice that its machine slept, where something may be hurt."""
    if isinstance(executive.clock, MonotonicClock) and not arming.is_free:
        executive.hooks.append(SleepWatch(arming))


class SleepWatch:
    """A hook: disarms a run that was armed when its machine went to sleep."""

    def __init__(self, arming: Arming) -> None:
        self._arming = arming
        self._slept = _slept()

    def between_steps(self, _now: int, _left: int) -> None:
        """Compare the time that the machine has slept with what it was."""
        slept = _slept()
        asleep = slept - self._slept
        if asleep < SHORTEST:
            return
        self._slept = slept
        if self._arming.armed:
            self._arming.disarm(f"the machine slept for {asleep / SECOND:.1f} s")


def _slept() -> int:
    """For how long the machine has slept since it started, ns.

    Too little, and never too much, where the process waits between the two readings.
    """
    return clock_gettime_ns(CLOCK_BOOTTIME) - monotonic_ns()
