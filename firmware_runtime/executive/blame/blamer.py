"""Reads the counters after a late activation, and once a second, and has the rules judge them.

A step on time costs nothing: it is not looked at. Once a second, after a step that was on time, a
reading is kept: what comes later is compared with it. After a late one, or a step that took much
longer than usual, counters are read as soon as there is slack, what is usual is taken off
(`usual`), and the rules name a cause. Readings lie `GAP` apart, so that a loop that is late all the
time is not made later by them; of several steps that one reading covers, the first is judged by it.

An activation that is late because of the step before has that step's cause: it was judged already.
"""

import mmap
from collections.abc import Sequence
from contextlib import ExitStack
from functools import cache
from operator import attrgetter
from time import thread_time_ns

from msgspec import structs

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.blame.late import Late, Metered
from firmware_runtime.executive.blame.rules import ENOUGH, Evidence, Verdict, verdict
from firmware_runtime.executive.blame.usual import Grown, Mark, Quiet, beyond_usual, grown
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.statistics.blame import CAUSES, NOT_MEASURED, NOTHING, BlameRow
from firmware_runtime.system.machine_counters import CONTINUED
from firmware_runtime.system.thread_counters import Counted, ThreadCounters

GAP = MILLISECOND
"""Ns from one reading to the next; a late activation in between has no evidence."""
UNREAD = BlameRow(cause=1)
"""Late, and the counters were not read."""


class Blamer:
    """Judges the late steps of one run in real time."""

    def __init__(
        self,
        clock: MonotonicClock,
        accounts: Sequence[ModelAccount],
        meters: Sequence[Metered],
    ) -> None:
        self._clock = clock
        self._accounts = accounts
        self._meters = meters
        self._counters: ThreadCounters | None = None
        self._before: Mark | None = None
        self._quiet: Quiet | None = None
        self._usual: Grown | None = None
        """Of the quiet time, as soon as it has been asked for."""
        self._read_at = -GAP
        self._others = 0
        self._last: BlameRow = NOTHING
        self._last_ended = -1

    def open(self, steps: int) -> None:
        """Open the counters and read them; in the thread that runs the loop."""
        fault_ns()
        CONTINUED.watch()
        self._counters = ThreadCounters()
        self._before = self._mark(self._counters, steps)

    def close(self) -> None:
        """Close them: the run is over or pauses."""
        if self._counters is not None:
            CONTINUED.unwatch()
            self._counters.close()
            self._counters = self._before = None

    def keep(self, steps: int) -> None:
        """Read what later readings are compared with; nothing has been late since the last."""
        if self._counters is None or self._before is None:
            return
        mark = self._mark(self._counters, steps)
        found = Quiet(self._before, mark, self._others)
        if found.is_to_replace(self._quiet):
            self._quiet, self._usual = found, None
        self._before, self._others = mark, 0

    def pass_over(self, beyond: int) -> None:
        """Note what a step that is not judged took beyond the usual."""
        self._others += beyond

    def explain(self, late: Sequence[Late]) -> list[BlameRow]:
        """Why these steps, the last of which has just ended, were late, or took so long."""
        if self._counters is None or self._before is None:
            return [NOTHING] * len(late)
        self._others += sum([each.beyond for each in late])
        rows, read_at = list[BlameRow](), self._read_at
        for each in late:
            is_behind = each.behind > each.wake + each.in_step
            if is_behind and each.previous_end == self._last_ended:
                explained = min(self._last.explained_ns, each.of)
                row = structs.replace(self._last, of_ns=each.of, explained_ns=explained)
            elif read_at != self._read_at or each.ended < read_at + GAP:
                row = structs.replace(UNREAD, of_ns=each.of)
            else:
                self._read_at = late[-1].ended
                row = self._judge(self._counters, self._before, each)
            self._last, self._last_ended = row, each.ended
            rows.append(row)
        return rows

    def _judge(self, counters: ThreadCounters, before: Mark, late: Late) -> BlameRow:
        mark = self._mark(counters, late.steps)
        if self._usual is None and self._quiet is not None:
            self._usual = grown(self._quiet.before, self._quiet.after)
        self._others -= late.beyond
        evidence = self._evidence(late, beyond_usual(grown(before, mark), self._usual))
        if min(evidence.cpu_ns, evidence.in_step_ns) >= ENOUGH * evidence.of_ns:
            evidence = structs.replace(evidence, supply=counters.supply())
        if (evidence.slept_ns or 0) >= ENOUGH * evidence.of_ns:
            evidence = structs.replace(evidence, is_traced=counters.is_traced())
        self._before, self._others = mark, 0
        return _row(evidence, verdict(evidence))

    def _mark(self, counters: ThreadCounters, steps: int) -> Mark:
        retries = sum(meter.retries for meter in self._meters)
        return Mark(counters.read(), steps, retries)

    def _evidence(self, late: Late, found: Grown) -> Evidence:
        counted = found.counted
        faults = (counted.minor_faults + counted.major_faults) * fault_ns()
        return Evidence(
            **dict(zip(_SAME, _same_of(counted), strict=True)),
            of_ns=late.of,
            others_ns=self._others,
            usual_cpu_ns=self._usual_cpu(),
            may_have_slept=counted.voluntary > 0 or self._sleeps_in_steps(),
            before_wait_ns=self._before_wait(late),
            in_step_ns=late.in_step + late.behind,
            garbage_ns=late.garbage,
            bus_ns=self._busy_beyond_mean(late),
            faults_ns=min(faults, counted.cpu_ns),
            stops=counted.continued,
            retries=found.retries,
            model=self._slowest(late),
            device=self._busiest(late),
        )

    def _usual_cpu(self) -> int:
        """Processor time of a usual step, ns; 0 where that is not known."""
        return 0 if not self._usual else self._usual.counted.cpu_ns // max(self._usual.steps, 1)

    def _sleeps_in_steps(self) -> bool:
        """Whether a usual step goes to sleep itself, beside the loop that waits for the next."""
        return not self._usual or 2 * self._usual.counted.voluntary > 3 * self._usual.steps

    def _before_wait(self, late: Late) -> int:
        """Of `wake`, what passed before the loop came to its wait; 0 if it was there in time."""
        began_at = late.ended - late.step
        return min(max(self._clock.overdue_at - (began_at - late.wake), 0), late.wake)

    def _slowest(self, late: Late) -> int:
        """The model that took the most beyond its usual time; -1 where it was a step before."""
        if late.in_step < late.behind:
            return NOT_MEASURED
        beyond = [
            own - account.own_time.sum // max(account.run + account.reactions, 1)
            for account, own in zip(self._accounts, late.own_times, strict=True)
        ]
        return beyond.index(max(beyond)) if beyond else NOT_MEASURED

    def _busy_beyond_mean(self, late: Late) -> int:
        """Ns that devices had their buses for in this step, beyond the mean of all steps."""
        here = sum(map(sum, late.spent))
        in_all = sum([meter.busy_ns for meter in self._meters])
        return max(here - in_all // max(late.steps, 1), 0)

    def _busiest(self, late: Late) -> int:
        """The device that had its bus the longest in this step, as a `BlameRow` numbers it."""
        longest, device = 0, NOT_MEASURED
        for number, (meter, spent) in enumerate(zip(self._meters, late.spent, strict=True)):
            if max(spent) > longest:
                longest = max(spent)
                device = number << 8 | meter.addresses()[spent.index(longest)]
        return device


_SAME = tuple(set(Counted.__struct_fields__) & set(Evidence.__struct_fields__))
_same_of = attrgetter(*_SAME)


def _row(evidence: Evidence, found: Verdict) -> BlameRow:
    """A verdict and its evidence, as the file keeps them."""
    values = dict(zip(_KEPT, _kept_of(evidence), strict=True))
    return BlameRow(
        **{
            **{name: NOT_MEASURED if each is None else each for name, each in values.items()},
            "cause": 1 + CAUSES.index(found.cause),
            "culprit": found.culprit,
            "explained_ns": found.explained_ns,
            "moved": int(evidence.was_moved),
        }
    )


_KEPT = tuple(name for name in BlameRow.__struct_fields__ if hasattr(Evidence, name))
_kept_of = attrgetter(*_KEPT)

PAGES = 16
BATCHES = 5


@cache
def fault_ns() -> int:
    """Ns of processor time for a page without I/O; what touching it takes is taken off.

    The median of a few batches of memory that is fresh for the process: a page is found, cleared
    and mapped. 0 where memory is refused.
    """
    try:
        with ExitStack() as kept:
            size = PAGES * mmap.PAGESIZE
            batches = [kept.enter_context(mmap.mmap(-1, size)) for _ in range(BATCHES)]
            found = sorted(map(_first_touch, batches))
            return max(found[(BATCHES - 1) // 2] // PAGES, 0)
    except (OSError, ValueError):
        return 0


def _first_touch(memory: mmap.mmap) -> int:
    """Of all pages together: the first touch, less the second."""
    first = _touch(memory)
    return first - _touch(memory)


def _touch(memory: mmap.mmap) -> int:
    began = thread_time_ns()
    for at in range(0, len(memory), mmap.PAGESIZE):
        memory[at] = 1
    return thread_time_ns() - began
