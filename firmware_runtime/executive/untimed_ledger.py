"""The ledger of a run whose functions take no time: in virtual time, with nothing kept in a file.

Nothing is late, no step takes long, and nothing but this process can read what is counted. So a
step is counted, and nothing of it is written: steps, accounts of models without a period, buses,
deadlines and faults are copied into the cells once a second, and before anything reads them.
"""

from collections.abc import Callable

from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.ledger import Ledger
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.progress import Progress
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ELAPSED, STEP_TIMES, STEPS
from firmware_runtime.statistics.statistics import Statistics


class UntimedLedger(Ledger):
    """A `Ledger` on a clock that stands still during a step."""

    _ended = _lag = 0
    """When the last step ended, and by how much logical time was behind then."""

    def commit(self, ended: int, next_at: Callable[[], int]) -> int:
        """Count the step that has just ended; return when the next event is due."""
        if ended >= self._look_at:
            self._look(ended, next_at() - ended)
        self._accounting.settle_untimed()
        self._steps += 1
        due, progress = next_at(), self._progress
        self._ended = ended
        self._lag = 0 if due >= ended and progress.is_level else progress.note(ended, due)
        return due

    def statistics(self) -> Statistics:
        """A copy of what has been counted so far."""
        self._copy()
        return super().statistics()

    def pause(self, now: int) -> None:
        """Note that the run stands still at `now`."""
        self._copy()
        super().pause(now)

    def finish(self, state: RunState, now: int, reason: str) -> None:
        """Write how the run ended; what was due by then, and has not run, is skipped."""
        self._copy()
        super().finish(state, now, reason)
        self._copy()

    def _look(self, ended: int, left: int) -> None:
        self._copy()
        super()._look(ended, left)

    def _copy(self) -> None:
        """Write what has been counted, in a section of its own; every step took no time."""
        file = self.file
        file.open_section()
        self._counters.read()
        self._accounting.copy_into(file.cells, file.layout)
        file.cells[STEPS] = file.cells[STEP_TIMES] = self._steps
        if self._ended > file.cells[ELAPSED]:
            file.close_section(self._ended, self._lag)
        else:
            file.close_section_as_it_was()


def open_ledger(
    file: StatisticsFile, profiler: Profiler, inbox: Inbox, clock: Clock, progress: Progress
) -> Ledger:
    """The ledger of a run, by whether its functions take time."""
    kind = Ledger if profiler.step.takes_time else UntimedLedger
    return kind(file, profiler, inbox, clock, progress)
