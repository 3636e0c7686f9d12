"""The files that a run keeps beside its statistics: one name, an ending each.

tachobot.stats      the statistics, see `paths`
tachobot.guard      what the guard has done
tachobot.settings   the settings that the outputs are driven by
tachobot.starts     how the last starts of the service went
tachobot.safe-state when safe-state was last called for it
tachobot.recording  what entered the run, see `blackbox`
tachobot.socket     where other processes speak with the run and its ports

tachobot-guard.starts   how the last starts of its guard went
"""

import os
from enum import StrEnum
from pathlib import Path

from firmware_runtime.errors import StatisticsFileError


class Companion(StrEnum):
    """What a run keeps beside its statistics, by its ending."""

    TAKEOVERS = ".guard"
    SETTINGS = ".settings"
    STARTS = ".starts"
    SAFE_STATE = ".safe-state"
    RECORDING = ".recording"
    SOCKET = ".socket"

    def beside(self, statistics: Path) -> Path:
        """Where a run keeps it that keeps its statistics at this path."""
        return statistics.with_suffix(self)


def of_guard(statistics: Path) -> Path:
    """The path that a guard's own companions stand beside, given the statistics of its run."""
    return statistics.with_stem(f"{statistics.stem}-guard")


def check_ending(statistics: Path) -> None:
    """Raise StatisticsFileError for a path that no statistics can have.

    That is one of what is no regular file or without a name, or one that ends as a companion does.
    """
    is_taken = "\0" in statistics.name or (
        os.path.exists(statistics) and not os.path.isfile(statistics)  # noqa: PTH110, PTH113
    )
    if not statistics.name or is_taken:
        raise StatisticsFileError("expected the path of a file", where=f"{str(statistics)!r}")
    if statistics.suffix in set(Companion):
        raise StatisticsFileError(
            f"expected another ending; {statistics.suffix} is for a file beside statistics",
            where=statistics,
        )
