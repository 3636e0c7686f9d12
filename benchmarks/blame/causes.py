"""The ten causes that are injected, what each should be called, and who injects it.

From within: the victim's own model does it, every tenth tick. From outside: another process does
it, beside the victim.
"""

from typing import NamedTuple

from firmware_runtime.statistics.blame import Cause


class Injected(NamedTuple):
    """One cause: how the statistics should name it, and how the victim is to be scheduled."""

    about: str
    right: Cause
    from_within: bool
    is_fifo: bool = True
    """Whether the victim asks for SCHED_FIFO; a quota holds back ordinary processes only."""


INJECTED = {
    "hog-equal": Injected("a process at the same priority computes", Cause.PREEMPTED, False),
    "hog-higher": Injected("a process at a higher priority computes", Cause.PREEMPTED, False),
    "quota": Injected("the control group's quota is used up", Cause.THROTTLED, False, False),
    "faults": Injected("pages of memory and of a file are gone", Cause.FAULTS, True),
    "garbage": Injected("objects in cycles are collected", Cause.GARBAGE, True),
    "retries": Injected("a device does not answer twice", Cause.BUS, True),
    "slow-model": Injected("a model computes for long", Cause.MODEL, True),
    "stop": Injected("SIGSTOP, and later SIGCONT", Cause.STOPPED, False),
    "move": Injected("the loop is moved to a busy processor", Cause.MOVED, False),
    "sync": Injected("a model writes to a disk and waits for it", Cause.DISK, True),
    "reader": Injected("a reader of the statistics never pauses", Cause.PREEMPTED, False),
}
"""By name, in the order of the table."""
PERIOD_MS = 10
WARM_UP_S = 1.3
"""By then the victim has read its counters for a first quiet second."""
SPACING_S = 0.1
"""From one injection to the next."""
SHORTEST_MS, LONGEST_MS = 12.0, 18.0
"""How long something from outside lasts: a whole period and then some, so that one tick is late."""
