"""A word to the reader of a board's statistics whose last run left none: it was in virtual time."""

import sys
from pathlib import Path

from firmware_runtime.recording.blackbox.locations import virtual_recordings
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.number_formats import local
from firmware_runtime.statistics.paths import places
from firmware_runtime.statistics.statistics import Statistics


def say_if_last_run_was_virtual(path: Path, statistics: Statistics) -> None:
    """Say on standard error that these statistics of a board are of the run before its last.

    That is so where a recording of a run in virtual time is newer than the end of theirs.
    """
    board = path.stem
    is_under_way = statistics.state is RunState.RUNNING and statistics.writer_alive
    if is_under_way or path not in places(board):
        return
    header = statistics.header
    began = path.stat().st_mtime_ns if header.began is None else header.began[1]
    ended = began + round(statistics.cells[ELAPSED] / (header.clock_speed or 1))
    if all(each.stat().st_mtime_ns <= ended for each in virtual_recordings(board)):
        return
    print(
        f"firmware-runtime: the last run of {board} was in virtual time, which leaves no "
        f"statistics without --statistics; these are of the run before it, {local(began)}",
        file=sys.stderr,
    )
