"""Reads the counters after a late activation, and once a second, and has the rules judge them.

A step on time costs nothing: it is not looked at. Once a second, after a step that was on time, a
reading is kept: what comes later is compared with it. After a late one, or a step that took much
longer than usual, counters are read, what is usual is taken off (`usual`), and the rules name a
cause. Readings lie `GAP` apart, so that a loop that is late all the time is not made later by them.

An activation that is late because of the step before has that step's cause: it was judged already.
"""

from collections.abc import Sequence

from msgspec import structs

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.blame.fault_cost import fault_ns
from firmware_runtime.executive.blame.late import NOTHING, Late
from firmware_runtime.executive.blame.rules import ENOUGH, Evidence, Verdict, verdict
from firmware_runtime.executive.blame.usual import Grown, Mark, Quiet, beyond_usual, grown
from firmware_runtime.executive.bus_meter import BusMeter
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.blame import CAUSES, NOT_MEASURED, BlameRow
from firmware_runtime.system.machine_counters import CONTINUED
from firmware_runtime.system.thread_counters import ThreadCounters

GAP = MILLISECOND
"""Ns from one reading to the next; a late activation in between has no evidence."""
UNREAD = BlameRow(cause=1)
"""Late, and the counters were not read."""


class Blamer:
    """Judges the late steps of one run, in real time; on any other clock there is nothing to."""

    def __init__(
        self,
        clock: Clock,
        step: Step,
        accounts: Sequence[ModelAccount],
        meters: Sequence[BusMeter],
    ) -> None:
        self._clock = clock if isinstance(clock, MonotonicClock) and clock.speed == 1 else None
        self._step = step
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
        if self._clock is not None:
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

    def pass_over(self, ended: int, beyond: int) -> None:
        """Note what the step that has just ended took beyond the usual, unless it was judged."""
        if ended != self._read_at:
            self._others += beyond

    def explain(self, late: Late, steps: int) -> BlameRow:
        """Why the step that has just ended was late, or took so long."""
        if self._counters is None or self._before is None:
            return NOTHING
        of_ns = late.of
        is_behind = late.behind > late.wake + late.in_step
        if is_behind and late.previous_end == self._last_ended:
            row = structs.replace(
                self._last, of_ns=of_ns, explained_ns=min(self._last.explained_ns, of_ns)
            )
        elif late.ended < self._read_at + GAP:
            row = structs.replace(UNREAD, of_ns=of_ns)
        else:
            row = self._judge(self._counters, self._before, late, steps)
        self._last, self._last_ended = row, late.ended
        return row

    def _judge(self, counters: ThreadCounters, before: Mark, late: Late, steps: int) -> BlameRow:
        self._read_at = late.ended
        mark = self._mark(counters, steps)
        if self._usual is None and self._quiet is not None:
            self._usual = grown(self._quiet.before, self._quiet.after)
        evidence = self._evidence(late, beyond_usual(grown(before, mark), self._usual), steps)
        if min(evidence.cpu_ns, evidence.in_step_ns) >= ENOUGH * evidence.of_ns:
            evidence = structs.replace(evidence, supply=counters.supply())
        if (evidence.slept_ns or 0) >= ENOUGH * evidence.of_ns:
            evidence = structs.replace(evidence, is_traced=counters.is_traced())
        self._before, self._others = mark, 0
        return _row(evidence, verdict(evidence))

    def _mark(self, counters: ThreadCounters, steps: int) -> Mark:
        retries = sum(meter.retries for meter in self._meters)
        return Mark(counters.read(), steps, retries)

    def _evidence(self, late: Late, found: Grown, steps: int) -> Evidence:
        counted = found.counted
        faults = (counted.minor_faults + counted.major_faults) * fault_ns()
        same_names = (
            name for name in counted.__struct_fields__ if name in Evidence.__struct_fields__
        )
        return Evidence(
            **{name: getattr(counted, name) for name in same_names},
            of_ns=late.of,
            others_ns=self._others,
            usual_cpu_ns=self._usual_cpu(),
            may_have_slept=counted.voluntary > 0 or self._sleeps_in_steps(),
            before_wait_ns=self._before_wait(late),
            in_step_ns=late.in_step + late.behind,
            garbage_ns=late.garbage,
            bus_ns=self._busy_beyond_mean(steps),
            faults_ns=min(faults, counted.cpu_ns),
            stops=counted.continued,
            retries=found.retries,
            model=self._slowest(late),
            device=self._busiest(),
        )

    def _usual_cpu(self) -> int:
        """Processor time of a usual step, ns; 0 where that is not known."""
        return 0 if not self._usual else self._usual.counted.cpu_ns // max(self._usual.steps, 1)

    def _sleeps_in_steps(self) -> bool:
        """Whether a usual step goes to sleep itself, beside the loop that waits for the next."""
        return not self._usual or 2 * self._usual.counted.voluntary > 3 * self._usual.steps

    def _before_wait(self, late: Late) -> int:
        """Of `wake`, what passed before the loop came to its wait; 0 if it was there in time."""
        overdue_at = 0 if self._clock is None else self._clock.overdue_at
        began_at = late.ended - late.step
        return min(max(overdue_at - (began_at - late.wake), 0), late.wake)

    def _slowest(self, late: Late) -> int:
        """The model that took the most beyond its usual time; -1 where it was a step before."""
        if late.in_step < late.behind:
            return NOT_MEASURED
        beyond = [
            own - account.own_time.sum // max(account.run + account.reactions, 1)
            for account, own in zip(self._accounts, self._step.own_times, strict=True)
        ]
        return beyond.index(max(beyond)) if beyond else NOT_MEASURED

    def _busy_beyond_mean(self, steps: int) -> int:
        """Ns that devices had their buses for in this step, beyond the mean of all `steps`."""
        here = sum(spent for meter in self._meters for _, spent in meter.spent())
        in_all = sum(meter.busy_ns for meter in self._meters)
        return max(here - in_all // max(steps, 1), 0)

    def _busiest(self) -> int:
        """The device that had its bus the longest in this step, as a `BlameRow` numbers it."""
        found = max(
            (
                (spent, number << 8 | address)
                for number, meter in enumerate(self._meters)
                for address, spent in meter.spent()
            ),
            default=(0, NOT_MEASURED),
        )
        return found[1] if found[0] > 0 else NOT_MEASURED


def _row(evidence: Evidence, found: Verdict) -> BlameRow:
    """A verdict and its evidence, as the file keeps them."""
    kept = {
        name: value
        for name in BlameRow.__struct_fields__
        if (value := getattr(evidence, name, None)) is not None
    }
    return BlameRow(
        **{
            **kept,
            "cause": 1 + CAUSES.index(found.cause),
            "culprit": found.culprit,
            "explained_ns": found.explained_ns,
            "moved": int(evidence.was_moved),
        }
    )
