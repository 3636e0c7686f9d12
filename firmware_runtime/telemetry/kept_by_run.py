"""Whether a run that goes on keeps its statistics at a path: the guard finds it by them."""

import os
from pathlib import Path

from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.layout import STATE
from firmware_runtime.telemetry.mapped_file import CELL
from firmware_runtime.telemetry.process_identity import is_running
from firmware_runtime.telemetry.statistics import RunState
from firmware_runtime.telemetry.statistics_file import SAVED, STATISTICS


def keep_clear_of_other_runs(path: Path) -> None:
    """Refuse a path that is in use: its guard and its control socket would be taken from a run.

    Only a run with outputs outside its own process has either. Raises StatisticsFileError.
    """
    try:
        with STATISTICS.opened(path) as file:
            header = file.header
            state: int = CELL.unpack(file.read(STATE * CELL.size, CELL.size))[0]
    except StatisticsFileError:
        return  # none, or none of ours: it will be replaced
    if SAVED in header or "switched_off" not in header["conditions"]:
        return
    writer = header["writer"]
    if state == RunState.RUNNING and writer["pid"] != os.getpid() and is_running(writer):
        raise StatisticsFileError(
            f"{path}: process {writer['pid']} drives a robot and keeps its statistics there, where "
            "its guard looks; expected another file, see --statistics"
        )
