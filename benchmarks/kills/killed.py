"""SIGKILL at an instant that is known, however busy the machine is."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from time import monotonic_ns
from typing import Final, NamedTuple

PRIORITY: Final = 98
"""Under SCHED_FIFO: above a robot's loop and below its doubles."""


class Killed(NamedTuple):
    """A process was killed between these two instants, ns of CLOCK_MONOTONIC."""

    before: int
    after: int


def kill_now(process: int) -> Killed:
    """Kill a process. At ordinary priority the call was seen to come 7 ms after the clock's."""
    with _coming_first():
        before = monotonic_ns()
        os.kill(process, signal.SIGKILL)
        return Killed(before, monotonic_ns())


@contextmanager
def _coming_first() -> Iterator[None]:
    """Let this thread come before others, where that is allowed."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
