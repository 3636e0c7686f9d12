"""Late steps: noted as they end, explained in slack; and the worst activations of a run."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from msgspec import structs

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.blame.late import Late, Metered
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.statistics.blame import NOTHING, BlameRow, Cause, sentence, verdict_of
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.system.this_system import IS_LINUX

if TYPE_CHECKING:
    from firmware_runtime.executive.blame.blamer import Blamer

RESERVE = 300 * MICROSECOND
"""Ns that must be left to the next event for counters to be read after a step."""
SLOW = 4
"""A step that is late, or long, by so great a part of what is tolerated is slow."""
AGAIN = 50 * MILLISECOND
"""Ns after which that is tried again; a late step is explained by then, whatever is left."""
MOST_WAITING = 8
"""Late steps that wait for it at most."""
_UNEXPLAINED = "not explained yet"


class _Noted(NamedTuple):
    """A step that is to be explained, or to be kept among the worst."""

    account: ModelAccount
    """Of the activation that ran latest."""
    at: int
    lateness: int
    late: Late
    is_late: bool
    opens_episode: bool


class LateSteps:
    """Notes the late steps of a run, and names their causes; keeps its `worst` activations.

    `has_work` says that there is something to do in slack. A step that took more than `slow` ns,
    from its instant or the end of the one before, was slow; NEVER while it is not known what is.
    """

    def __init__(
        self, file: StatisticsFile, profiler: Profiler, clock: Clock, buses: Sequence[Metered]
    ) -> None:
        self.worst = WorstList(file.cells, file.layout)
        self.slow = NEVER
        self.has_work = False
        self._usual, self._long = 0, NEVER
        """What a step takes, and what is much longer."""
        self._file = file
        self._step = profiler.step
        self._garbage = profiler.garbage
        self._tolerance = profiler.accounting.tolerance
        self._buses = buses
        self._blamer = _blamer_for(clock, profiler.accounting.accounts, buses)
        self._late_by_cause = file.cells[file.layout.late_by_cause]
        self._waiting: list[_Noted] = []
        """Steps that have not been explained yet."""
        self._is_reading_due = False

    def learn(self, usual: int) -> None:
        """Take it that a step takes so long, ns."""
        self._usual = usual
        self._long = usual + self._tolerance
        self.slow = usual + self._tolerance // SLOW

    def ask_for_reading(self) -> None:
        """Let the counters be read in slack, after a step on time."""
        if self._blamer is not None:
            self.has_work = self._is_reading_due = True

    def use_slack(self, left: int, steps: int) -> bool:
        """Do what waits for it, if that fits into the `left` ns to the next event.

        Find out why steps were late; else read the counters, after so many steps. A reading takes
        some 0.1 ms. Returns whether there was time for that.
        """
        waiting, ended, blamer = self._waiting, self._step.ended, self._blamer
        if waiting:
            is_old = len(waiting) >= MOST_WAITING or ended - waiting[0].late.ended >= AGAIN
            if left >= RESERVE or blamer is None or is_old:
                self._explain()
            return True
        self.has_work = self._is_reading_due = False
        if left < RESERVE:
            return False
        if blamer is not None and ended - self._step.at <= self._long:
            blamer.keep(steps)
        return True

    def note(self, latest: ModelAccount, previous_end: int, spent: int, steps: int) -> None:
        """Note the step of the activation that ran latest, to be explained in slack.

        The step before had ended at `previous_end`, and from then on this one took `spent`.
        """
        step = self._step
        step_time = step.ended - step.started
        is_late = latest.in_episode or step_time > self._long
        if not is_late:
            self.pass_over(spent)
            if latest.lateness + step_time <= self.worst.smallest:
                return
        behind = max(previous_end - step.at, 0)
        wake = max(step.started - step.at - behind, 0)
        late = Late(
            ended=step.ended,
            behind=behind,
            wake=wake,
            step=step_time,
            usual_step=step_time if self._long == NEVER else self._usual,
            garbage=self._garbage.spent,
            previous_end=previous_end,
            own_times=tuple(step.own_times),
            spent=[tuple(bus.spent) for bus in self._buses],
            beyond=spent - self._usual if spent > self.slow else 0,
            steps=steps,
        )
        opens = latest.in_episode and latest.cause == ""
        if opens:
            latest.cause = _UNEXPLAINED
        noted = _Noted(latest, step.at, latest.lateness, late, is_late, opens)
        self._waiting.append(noted)
        self.has_work = True

    def pass_over(self, spent: int) -> None:
        """Note that the step was slow, if it was, and is not judged."""
        if spent > self.slow and self._blamer is not None:
            self._blamer.pass_over(spent - self._usual)

    def _explain(self) -> None:
        """Name the causes of late steps, also as those of episodes; keep the worst."""
        waiting, rows = self._waiting, dict[int, BlameRow]()
        if self._blamer is not None:
            late = [noted.late for noted in waiting if noted.is_late]
            found = zip(late, self._blamer.explain(late), strict=True)
            rows = {each.ended: row for each, row in found}
        self._file.open_section()
        for noted in waiting:
            row, account = rows.get(noted.late.ended, NOTHING), noted.account
            if row.cause > 0:
                self._late_by_cause[row.cause - 1] += 1
            if noted.opens_episode and account.cause == _UNEXPLAINED:
                account.cause = self._cause_of(noted, row)
            if noted.lateness + noted.late.step > self.worst.smallest:
                self._keep(noted, row)
        self._file.close_section_as_it_was()
        waiting.clear()
        self.has_work = self._is_reading_due

    def open(self, steps: int) -> None:
        """Begin to read the counters, after so many steps: the run begins, or goes on."""
        if self._blamer is not None:
            self._blamer.open(steps)

    def close(self) -> None:
        """Explain what waits for it, and read no counters any more."""
        if self._waiting:
            self._explain()
        if self._blamer is not None:
            self._blamer.close()

    def _cause_of(self, noted: _Noted, row: BlameRow) -> str:
        """Why it was late, in a few words; where that is unknown, where the time went.

        The latter is one of the keys in `causes`.
        """
        found = verdict_of(row, self._file.layout)
        if found is not None and found.cause != Cause.UNKNOWN:
            return sentence(found)
        late = noted.late
        spent = {"wake": late.wake, "behind": late.behind, "garbage": late.garbage}
        paths = self._step.paths[: noted.account.number]
        spent.update(dict(zip(paths, late.own_times, strict=False)))
        return max(spent, key=spent.__getitem__)

    def _keep(self, noted: _Noted, blame: BlameRow) -> None:
        """Put an activation on the list of the worst, with what the step spent its time on."""
        late = noted.late
        row = [noted.at, noted.account.number, noted.lateness, late.step, late.wake, late.behind]
        row += late.garbage, *late.own_times
        for bus, spent in zip(self._buses, late.spent, strict=True):
            row += *bus.addresses(), *spent
        row += structs.astuple(blame)
        self.worst.keep(row)


def _blamer_for(
    clock: Clock, accounts: Sequence[ModelAccount], buses: Sequence[Metered]
) -> "Blamer | None":
    """What judges late steps by Linux's counters; loaded in real time only, where some can be."""
    if not (IS_LINUX and isinstance(clock, MonotonicClock) and clock.speed == 1):
        return None
    from firmware_runtime.executive.blame.blamer import Blamer  # noqa: PLC0415 -- see above

    return Blamer(clock, accounts, buses)
