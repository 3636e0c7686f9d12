"""Whether a run that goes on keeps its statistics at a path: the guard finds it by them."""

import os
from pathlib import Path

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file import STATISTICS, driver_of
from firmware_runtime.statistics.layout import STATE
from firmware_runtime.statistics.mapped_file import CELL
from firmware_runtime.statistics.statistics import RunState
from firmware_runtime.system.process_identity import is_running


def keep_clear_of_other_runs(path: Path) -> str | None:
    """Refuse a path that is in use: a run's sockets, recording and guard would be taken from it.

    Returns what is wrong with a file there that is damaged: a run may replace it. Raises
    StatisticsFileError for one in use.
    """
    if not os.path.lexists(path):
        return None
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
