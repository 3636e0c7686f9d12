"""Priority and processors of a process: before ordinary ones, and off those of a run.

Two processes that share a processor wait for each other; and the kernel moves a process of ordinary
priority from a run's processor only after it has been in its way.

Sources: sched(7), getrlimit(2) RLIMIT_RTPRIO, sched_setaffinity(2): threads and processes that are
started later have the same set.
"""

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress

PRIORITIES = (60, 61)
"""A run's, which is what its unit allows, and the next one, which a loop that hangs cannot keep off
the processor."""


def come_first() -> None:
    """Take the highest of these that this user may have; where it is none, all stays as it is."""
    with suppress(OSError):
        for priority in PRIORITIES:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def keep_off(given: Collection[int]) -> None:
    """Use the other processors only from now on; where none is left, all stays as it is."""
    if given and (others := os.sched_getaffinity(0).difference(given)):
        with suppress(OSError):
            os.sched_setaffinity(0, others)


@contextmanager
def kept_off(given: Collection[int]) -> Iterator[None]:
    """Let the processes that are started within the block keep off; this one does only there."""
    if not given:
        yield
        return
    before = os.sched_getaffinity(0)
    keep_off(given)
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, before)
