"""The ledger: after a step, all that is to be counted goes into the statistics file in one section.

During a step nothing is written, so a process killed in the middle of one leaves whole numbers.
"""

from collections.abc import Callable
from time import monotonic_ns

from msgspec import structs

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.blame.in_real_time import blamer_for
from firmware_runtime.executive.blame.late import NOTHING, Late
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.counters import Counters
from firmware_runtime.executive.cpu_time import CpuTime
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.statistics.blame import BlameRow, Cause, blame_of, sentence
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.history import Lately, Timeline, WorstList
from firmware_runtime.statistics.layout import (
    ACKNOWLEDGED,
    ARMED,
    CPU,
    ELAPSED,
    HEARTBEAT,
    STATE,
    STEP_HISTOGRAM,
    STEPS,
    WRITTEN,
    YIELDED,
)
from firmware_runtime.statistics.statistics import Statistics

FEW = 5
"""Steps after which it is known how long one takes."""
SETTLING = 100 * MILLISECOND
"""When a run reads its counters for the first time after its start; then each second."""

RESERVE = 300 * MICROSECOND
"""Ns that must be left to the next event for counters to be read after a step on time."""
SLOW = 4
"""A step that is late, or long, by so great a part of what is tolerated is slow."""
AGAIN = 50 * MILLISECOND
"""Ns after which that is tried again."""


class Ledger:
    """Writes steps, idle moments and the end of a run into the file.

    What would be due after the last instant that belongs to the run (`go_on`) is not counted.
    """

    def __init__(
        self,
        file: StatisticsFile,
        profiler: Profiler,
        inbox: Inbox,
        clock: Clock,
        progress: Progress,
    ) -> None:
        cells, layout = file.cells, file.layout
        self.file = file
        self._until = NEVER
        self._step = profiler.step
        self._accounting = profiler.accounting
        self._progress = progress
        self._garbage = profiler.garbage
        self._counters = Counters(file, profiler, inbox)
        self._step_times = Histogram(cells[STEP_HISTOGRAM])
        self._worst = WorstList(cells, layout)
        self._steps = 0
        self._previous_end = 0
        self._cpu_time = CpuTime(clock)
        profiler.accounting.count_in(cells, layout)
        self._timeline = Timeline(cells[layout.timeline], self._growing)
        self._look_at = SETTLING
        """When the next second is over, or the counters are to be read for the first time."""
        self._usual, self._long, self._slow = 0, NEVER, NEVER
        """What a step takes, what is much longer and what a little; NEVER while it is not known."""
        accounts, meters = self._accounting.accounts, self._counters.meters
        self._blamer = blamer_for(clock, profiler.step, accounts, meters)
        self._late_by_cause = cells[layout.late_by_cause]

    def commit(self, ended: int, next_at: Callable[[], int]) -> int:
        """Write the step that has just ended; return when the next event is due."""
        file, timeline, garbage = self.file, self._timeline, self._garbage
        step_time = ended - self._step.started
        if ended >= self._look_at:
            self._look(ended, next_at() - ended)
        file.open_section()
        until = self._until
        latest = self._accounting.settle(ended if ended <= until else until + 1)
        self._step_times.record(step_time)
        self._steps = file.cells[STEPS] = self._steps + 1
        self._counters.read()
        if step_time > timeline.step_max:
            timeline.step_max = step_time
        if latest is not None and (
            latest.lateness > timeline.lateness_max
            or latest.in_episode
            or latest.lateness + step_time > self._worst.smallest
        ):
            self._note(latest, step_time, garbage.spent)
        garbage.spent = 0
        due, progress = next_at(), self._progress
        caught_up = due >= ended and progress.is_level
        file.close_section(ended, 0 if caught_up else progress.note(ended, due))
        spent = ended - max(self._step.at, self._previous_end)
        if spent > self._slow and self._blamer is not None:
            self._blamer.pass_over(ended, spent - self._usual)
        self._previous_end = ended
        return due

    def arm(self, *, armed: bool, epoch: int) -> None:
        """Note whether the run may drive its outputs, and which epoch it has seen."""
        self.file.open_section()
        self.file.cells[ARMED] = armed
        self.file.cells[ACKNOWLEDGED] = epoch
        self.file.close_section_as_it_was()

    def give_up_priority(self, now: int) -> None:
        """Note that the run is an ordinary process from now on."""
        self.file.open_section()
        self.file.cells[YIELDED] = now
        self.file.close_section(now)

    def statistics(self) -> Statistics:
        """A copy of what has been counted so far."""
        return self.file.statistics()

    def lately(self, since: int) -> Lately:
        """What became of activations since then, or up to a second before; reads a few cells."""
        return self._timeline.lately(since)

    def idle(self, now: int) -> None:
        """Show that the loop is alive while nothing is due."""
        self._progress.idle()
        self.file.open_section()
        self.file.close_section(now)

    def stand_still(self) -> None:
        """Note that nothing is due any more, without a sign of life."""
        self.file.open_section()
        self.file.cells[WRITTEN] = monotonic_ns()
        self.file.close_section_as_it_was()

    def pause(self, now: int) -> None:
        """Note that the run stands still at `now`: nothing becomes overdue until it goes on."""
        file = self.file
        self._cpu_time.pause()
        if self._blamer is not None:
            self._blamer.close()
        file.open_section()
        self._counters.read()
        file.cells[ELAPSED] = now
        file.cells[HEARTBEAT] = file.cells[WRITTEN] = 0
        file.close_section_as_it_was()

    def go_on(self, until: int) -> None:
        """The run goes on, or begins, to instant `until`; processor time of a pause is not its."""
        self._until = until
        self._cpu_time.go_on()
        if self._blamer is not None:
            self._blamer.open(self._steps)

    def finish(self, state: RunState, now: int, reason: str) -> None:
        """Write how the run ended; what was due by then, and has not run, is skipped."""
        file = self.file
        if self._blamer is not None:
            self._blamer.close()
        file.open_section()
        self._accounting.end(min(now, self._until))
        self._counters.end()
        self._timeline.close(now)
        file.cells[ARMED] = False
        file.cells[STATE] = state
        text = file.cells[file.layout.reason].cast("B")
        text[:] = reason.encode()[: len(text)].ljust(len(text), b"\0")
        file.close_section(now)

    def _note(self, latest: ModelAccount, step_time: int, garbage: int) -> None:
        """Note the activation that ran latest: maximum, cause of an episode, one of the worst."""
        if latest.lateness > self._timeline.lateness_max:
            self._timeline.lateness_max = latest.lateness
        is_late = latest.in_episode or step_time > self._long
        blame = self._blame(step_time, garbage) if is_late else NOTHING
        if latest.in_episode and latest.cause == "":
            latest.cause = self._cause_of(latest, garbage, blame)
        if latest.lateness + step_time > self._worst.smallest:
            self._keep(latest, step_time, garbage, blame)

    def _waited(self) -> tuple[int, int]:
        """How long the step waited to begin: for the loop to wake up, behind the one before."""
        step = self._step
        behind = max(self._previous_end - step.at, 0)
        return max(step.started - step.at - behind, 0), behind

    def _blame(self, step_time: int, garbage: int) -> BlameRow:
        """Why the step was late, or took so long."""
        step, previous_end = self._step, self._previous_end
        wake, behind = self._waited()
        usual = step_time if self._long == NEVER else self._usual
        ended = step.started + step_time
        late = Late(ended, behind, wake, step_time, usual, garbage, previous_end)
        row = NOTHING if self._blamer is None else self._blamer.explain(late, self._steps)
        if row.cause > 0:
            self._late_by_cause[row.cause - 1] += 1
        return row

    def _look(self, ended: int, left: int) -> None:
        """Close the timeline's second if it is over; after a step on time, read the counters.

        With less than a reserve left to the next event that waits: a reading takes some 0.1 ms.
        """
        if ended >= self._timeline.closes_at:
            self.file.open_section()
            self._timeline.close(ended)
            self.file.close_section_as_it_was()
        if self._steps >= FEW:
            self._usual = self._step_times.sum // self._steps
            self._long = self._usual + self._accounting.tolerance
            self._slow = self._usual + self._accounting.tolerance // SLOW
        self._look_at = self._timeline.closes_at
        if left < RESERVE:
            self._look_at = min(self._look_at, ended + AGAIN)
        elif self._blamer is not None and ended - self._step.at <= self._long:
            self._blamer.keep(self._steps + 1)  # this one is not counted yet

    def _growing(self) -> list[int]:
        """The counters whose growth over time is kept; once a second."""
        cells = self.file.cells
        cells[CPU] = self._cpu_time.spent()
        busy = sum(meter.busy_ns for meter in self._counters.meters)
        return [*self._accounting.totals(), self._steps, busy, cells[CPU]]

    def _cause_of(self, latest: ModelAccount, garbage: int, blame: BlameRow) -> str:
        """Why it was late, in a few words; where that is unknown, where the time went.

        The latter is one of the keys in `causes`.
        """
        found = blame_of(blame, self.file.layout)
        if found is not None and found.cause != Cause.UNKNOWN:
            return sentence(found)
        step = self._step
        wake, behind = self._waited()
        spent = {"wake": wake, "behind": behind, "garbage": garbage}
        earlier = zip(step.paths[: latest.number], step.own_times, strict=False)
        spent.update(dict(earlier))
        return max(spent, key=spent.__getitem__)

    def _keep(self, latest: ModelAccount, step_time: int, garbage: int, blame: BlameRow) -> None:
        """Put an activation on the list of the worst, with what the step spent its time on."""
        step = self._step
        wake, behind = self._waited()
        row = [step.at, latest.number, latest.lateness, step_time, wake, behind, garbage]
        row += step.own_times
        for meter in self._counters.meters:
            row += meter.devices()
        row += structs.astuple(blame)
        self._worst.keep(row)
