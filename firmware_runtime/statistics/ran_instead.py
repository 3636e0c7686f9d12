"""Threads that had the processor while the loop could have run, from a trace of switches.

A thread can run from its waking on, or from when it lost its processor while it could have run on,
until a processor takes it up. What that processor ran in the meantime, it ran instead.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from msgspec import Struct

from firmware_runtime.statistics.number_formats import microseconds
from firmware_runtime.system.switch_trace import Switch, Thread

_REAL_TIME = 100
_NICE_0 = 120
_IDLE = 0


class RanInstead(Struct, frozen=True):
    """One thread that had the loop's processor, and for how long."""

    name: str
    pid: int
    scheduling: str
    """`FIFO or RR 80`, `nice 0`, `deadline`; `idle` where the processor did nothing."""
    cpu: int
    us: float

    def text(self) -> str:
        """It in a few words."""
        what = "nothing" if self.pid == _IDLE else f"{self.name} ({self.pid}, {self.scheduling})"
        return f"{what} {microseconds(self.us)} on CPU {self.cpu}"


class _Wait(NamedTuple):
    """The loop could run from one instant to another, when this processor took it up."""

    since: int
    until: int
    cpu: int


def ran_instead(switches: Sequence[Switch], pid: int, since: int, until: int) -> list[RanInstead]:
    """Return what ran while thread `pid` waited, longest first; instants of CLOCK_MONOTONIC.

    Nothing where it did not wait, or where the trace does not reach back so far. Kernels lose
    switches, some those from an idle processor: a stretch whose two ends name different threads
    had both, for an unknown time each, and is left out.
    """
    spent: Counter[tuple[Thread, int]] = Counter()
    for wait in _waits(switches, pid):
        begin, end = max(wait.since, since), min(wait.until, until)
        for thread, ns in _ran(switches, wait.cpu, begin, end):
            if thread.pid != pid:
                spent[thread, wait.cpu] += ns
    return [
        RanInstead(thread.name, thread.pid, _scheduling(thread), cpu, ns / 1000)
        for (thread, cpu), ns in spent.most_common()
    ]


def _waits(switches: Sequence[Switch], pid: int) -> Iterator[_Wait]:
    could_since: int | None = None
    for each in switches:
        if each.to is None:
            could_since = each.at if could_since is None else could_since
        elif each.to.pid == pid:
            if could_since is not None:
                yield _Wait(could_since, each.at, each.cpu)
            could_since = None
        elif each.before is not None and each.before.pid == pid:
            could_since = each.at if each.still_could else None


def _ran(
    switches: Sequence[Switch], cpu: int, begin: int, end: int
) -> Iterator[tuple[Thread, int]]:
    """The threads of one processor between two instants, with the ns of each."""
    thread, at = None, begin
    for each in switches:
        if each.cpu != cpu or each.to is None or each.before is None:
            continue
        if each.at > begin:
            span = min(each.at, end) - at
            if span > 0 and (thread is None or thread.pid == each.before.pid):
                yield each.before, span
            at = max(min(each.at, end), at)
        thread = each.to
        if each.at >= end:
            return


def _scheduling(thread: Thread) -> str:
    if thread.pid == _IDLE:
        return "idle"
    if thread.priority < 0:
        return "deadline"
    if thread.priority < _REAL_TIME:
        return f"FIFO or RR {_REAL_TIME - 1 - thread.priority}"
    return f"nice {thread.priority - _NICE_0}"
