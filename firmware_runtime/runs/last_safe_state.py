"""Last call of `safe-state` for a board: a run that had begun by then does not arm itself.

`safe-state` takes the right to drive from every run that it finds. One that still imports, builds
its model or waits before it starts again has no lines open and no statistics, and is not found. So
`safe-state` leaves the instant in `BOARD.safe-state` before it looks for runs, and a run reads it
once its lines are open and its statistics are there: whichever comes second sees the other.
"""

from collections.abc import Iterable
from pathlib import Path
from time import monotonic_ns
from typing import Final

from firmware_runtime.statistics.paths import Companion, places
from firmware_runtime.system.this_process import NoteOfBoot, boot_id, leave_note, read_note

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
