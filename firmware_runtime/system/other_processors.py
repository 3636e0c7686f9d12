"""A process beside a run keeps off the processors that the board gives to the run.

Two processes that share one wait for each other; and the kernel moves a process of ordinary
priority from a run's processor only after it has been in its way. Where no other processor is left,
all stays as it is.

Source: sched_setaffinity(2): threads and processes that are started later have the same set.
"""

import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress


def keep_off(given: Collection[int]) -> None:
    """Use the other processors only from now on."""
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
