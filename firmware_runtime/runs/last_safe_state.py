"""When `safe-state` was last called for a board: a run that had begun by then does not arm itself.

`safe-state` takes the right to drive from every run that it finds. One that still imports, builds
its model or waits before it starts again has no lines open and no statistics, and is not found. So
`safe-state` leaves the instant in `BOARD.safe-state` before it looks for runs, and a run reads it
once its lines are open and its statistics are there: whichever comes second sees the other.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from time import monotonic_ns
from typing import Annotated, Final

import msgspec

from firmware_runtime.statistics.companions import Companion
from firmware_runtime.statistics.paths import places
from firmware_runtime.system.process_identity import boot_id
from firmware_runtime.system.whole_file import read_file, replace_file

_MODE: Final = 0o644
"""A run of any user may read it: that can only keep it disarmed."""


class SafeStateCall(msgspec.Struct, frozen=True):
    """The instant `at_ns` (CLOCK_MONOTONIC) of that boot."""

    boot_id: str
    at_ns: Annotated[int, msgspec.Meta(ge=0)]


def note_safe_state(statistics: Path) -> None:
    """Leave the present instant for the runs that would keep their statistics there.

    Raises OSError.
    """
    path = Companion.SAFE_STATE.beside(statistics)
    path.parent.mkdir(parents=True, exist_ok=True)
    call = SafeStateCall(boot_id(), monotonic_ns())
    replace_file(path, msgspec.json.encode(call), _MODE)


def safe_state_files(board: str, statistics: Path | None) -> list[Path]:
    """Where a call may be noted: beside these statistics, and wherever the board's may be."""
    beside = () if statistics is None else (statistics,)
    return sorted({Companion.SAFE_STATE.beside(each) for each in (*beside, *places(board))})


def last_safe_state(files: Iterable[Path]) -> int:
    """The instant of the last call, ns of CLOCK_MONOTONIC; 0 where there was none in this boot."""
    return max(_instants(files), default=0)


def _instants(files: Iterable[Path]) -> Iterator[int]:
    for file in files:
        try:
            call = msgspec.json.decode(read_file(file), type=SafeStateCall)
        except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            continue
        if len({call.boot_id, boot_id()} - {""}) <= 1 and call.at_ns <= monotonic_ns():
            yield call.at_ns
