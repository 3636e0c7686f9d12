"""Scheduled before ordinary processes: for a program that switches off.

Source: sched(7), getrlimit(2) RLIMIT_RTPRIO.
"""

import os
from contextlib import suppress

PRIORITIES = (60, 61)
"""A run's, which is what its unit allows, and the next one, which a loop that hangs cannot keep off
the processor."""


def come_first() -> None:
    """Take the highest of these that this user may have; where it is none, all stays as it is."""
    with suppress(OSError):
        for priority in PRIORITIES:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
