"""A run as another process sees it, and its right to drive, which can be taken from it.

A run drives only under the *epoch* it was armed under: the cell `generation` of its statistics,
read before every write that could move something. Taking the right means putting another number
there: the present instant, ns, which was never there before and never will be again. So two
processes that take it at once, a guard and `safe-state`, need no lock and lose nothing: any epoch
but its own ends the run's right, and it acknowledges the one that it finds. An epoch below zero was
requested by a person: then the run does not arm itself again as its board may want.

`safe-state` takes the right to drive from every run that it finds. One that still imports, builds
its model or waits before it starts again has no lines open and no statistics, and is not found. So
`safe-state` leaves the instant in `BOARD.safe-state` before it looks for runs, and a run reads it
once its lines are open and its statistics are there: whichever comes second sees the other.
"""

import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from select import POLLIN, poll
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file_header import STATISTICS, RunState, driver_of
from firmware_runtime.statistics.layout import ACKNOWLEDGED, EPOCH, GUARD, HEARTBEAT, STATE
from firmware_runtime.statistics.mapped_file import CELL, SharedCells
from firmware_runtime.statistics.paths import Companion, places
from firmware_runtime.system.atomic_file import demand_regular
from firmware_runtime.system.this_process import (
    NoteOfBoot,
    boot_id,
    is_running,
    leave_note,
    read_note,
)

_PAUSES: Final = "its heartbeat is gone: the run pauses, or its statistics were overwritten"
_MODE: Final = 0o644
"""A run of any user may read it: that can only keep it disarmed."""


def note_safe_state(statistics: Path) -> None:
    """Leave the present instant for the runs that would keep their statistics there.

    Raises OSError.
    """
    call = NoteOfBoot(boot_id=boot_id(), at_ns=monotonic_ns())
    leave_note(Companion.SAFE_STATE.beside(statistics), call, _MODE)


def safe_state_files(board: str, statistics: Path | None) -> list[Path]:
    """Return where a call may be noted: beside these statistics, and the board's others."""
    beside = () if statistics is None else (statistics,)
    return sorted({Companion.SAFE_STATE.beside(each) for each in (*beside, *places(board))})


def last_safe_state(files: Iterable[Path]) -> int:
    """The instant of the last call, ns of CLOCK_MONOTONIC; 0 where there was none in this boot."""
    calls = (read_note(file, NoteOfBoot) for file in files)
    return max((call.at_ns for call in calls if call is not None), default=0)


class WatchedRun:
    """One run, as its statistics file and its process show it.

    `writer` is its process, `conditions` those of its header. Raises StatisticsFileError for a file
    that cannot be written or is no whole one, or whose process cannot be watched.
    """

    def __init__(self, path: Path) -> None:
        with STATISTICS.opened(path, os.O_RDWR) as file:
            driver = driver_of(file)
            self._cells = SharedCells(file)
        self.writer, self.conditions = driver.writer, driver.conditions
        self._drives_outputs = driver.has_outputs
        self._kept_settings = Companion.SETTINGS.beside(path)
        self._has_begun = False
        self._process: int | None = None
        try:
            self._process = os.pidfd_open(self.writer.pid)
        except ProcessLookupError:
            pass
        except OSError as error:
            raise StatisticsFileError(
                f"its process {self.writer.pid} cannot be watched ({error.strerror})", where=path
            ) from error
        # of another boot, or a number that was used again
        if driver.saved is not None or not is_running(self.writer):
            self.close()

    @property
    def ends(self) -> list[int]:
        """A descriptor that becomes readable when the process ends, if it has not."""
        return [] if self._process is None else [self._process]

    @property
    def has_ended(self) -> bool:
        """Return whether the process is gone."""
        if self._process is not None and is_readable([self._process], 0):
            self.close()
        return self._process is None

    @property
    def drives(self) -> bool:
        """Return whether it is under way and has outputs outside its own process."""
        if self.has_ended or not self._drives_outputs:
            return False
        with suppress(StatisticsFileError):
            return self._cells[STATE] == RunState.RUNNING
        return True

    @property
    def ended_with_outputs_off(self) -> bool:
        """True if it says that it is over, and keeps no settings of outputs that may be on.

        It keeps the settings that its outputs are driven by until they are off.
        """
        with suppress(StatisticsFileError):
            is_over = self._cells[STATE] != RunState.RUNNING
            return is_over and not os.path.lexists(self._kept_settings)
        return False

    @property
    def has_acknowledged(self) -> bool:
        """True if the run knows that its right to drive was taken; it is off then."""
        with suppress(StatisticsFileError):  # cut short: nothing can be seen in it any more
            return self._cells[ACKNOWLEDGED] == self._cells[EPOCH]
        return False

    def show_presence(self) -> None:
        """Let the run know that it is watched."""
        with suppress(StatisticsFileError):
            self._cells[GUARD] = monotonic_ns()

    def why_lost(self, stall: int) -> str:
        """Return why outputs must be taken from it, empty if they need not."""
        if self.has_ended:
            return f"process {self.writer.pid} has ended"
        try:
            heartbeat = self._cells[HEARTBEAT]
        except StatisticsFileError as error:
            return str(error)
        silent = monotonic_ns() - heartbeat
        if heartbeat == 0:
            return _PAUSES if self._has_begun else ""
        self._has_begun = True
        if silent < 0:
            return f"its heartbeat is {-silent / MILLISECOND:.0f} ms in the future"
        if silent > stall:
            return f"no finished step for {silent / MILLISECOND:.0f} ms"
        return ""

    def take_right(self, *, by_request: bool = False) -> bool:
        """Take its right to drive; return whether that could be written down."""
        with suppress(StatisticsFileError):
            self._cells[EPOCH] = -monotonic_ns() if by_request else monotonic_ns()
            return True
        return False

    @property
    def was_disarmed_by_request(self) -> bool:
        """Return whether the latest disarming was requested by a person."""
        with suppress(StatisticsFileError):
            return is_requested(self._cells[EPOCH])
        return False

    def close(self) -> None:
        """Stop watching the process."""
        if self._process is not None:
            os.close(self._process)
            self._process = None


def is_requested(epoch: int) -> bool:
    """Return whether a person requested this epoch, and not a guard."""
    return epoch < 0


def is_readable(descriptors: list[int], timeout_ns: int) -> bool:
    """Wait until one of these can be read, for so long at most; return whether one can."""
    poller = poll()
    for descriptor in descriptors:
        poller.register(descriptor, POLLIN)
    return bool(poller.poll(timeout_ns / MILLISECOND))


def keep_clear_of_other_runs(path: Path) -> str | None:
    """Refuse a path that is in use: a run's sockets, recording and guard would be taken from it.

    Returns what is wrong with a file there that is damaged: a run may replace it. Raises
    StatisticsFileError for one in use.
    """
    if not os.path.lexists(path):
        return None
    try:
        demand_regular(path)
    except OSError as error:  # a folder, a device: no run can take its place
        raise StatisticsFileError(
            error.strerror, where=path, expected="a place to write"
        ) from error
    try:
        with STATISTICS.opened(path) as file:
            driver = driver_of(file)
            state: int = CELL.unpack(file.read(STATE * CELL.size, CELL.size))[0]
    except StatisticsFileError as error:
        return str(error)
    writer = driver.writer
    if driver.saved is not None or state != RunState.RUNNING:
        return None
    if writer.pid != os.getpid() and is_running(writer):
        what = "drives a robot" if driver.has_outputs else "is a run"
        raise StatisticsFileError(
            f"process {writer.pid} {what} and keeps its statistics there, where guard "
            "and other commands look",
            where=path,
            expected="it to end first, or another file, see --statistics",
        )
    return None
