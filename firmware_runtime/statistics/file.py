"""The statistics file: counters of a run, placed as `layout` says, in a mapped file.

Cells that belong together are written between `open_section` and `close_section`, which make the
first cell, the sequence, odd and even again: a reader that sees the same even number before and
after its copy has copied no half of a section.
"""

from collections.abc import Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Any

from msgspec import convert
from msgspec.structs import replace

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file_header import STATISTICS, Header, Saved, count_overdue
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, SEQUENCE, Layout
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.atomic_file import keep_file
from firmware_runtime.system.this_process import this_process


def save(statistics: Statistics, path: Path) -> None:
    """Keep a reading in a file that can be read like a run's own; replaces what was there.

    Raises StatisticsFileError when it cannot be written, or a run's own file is there.
    """
    if _is_a_run_s_own(path):
        raise StatisticsFileError(
            "the file of a run itself", where=path, expected="another for a copy"
        )
    header = replace(statistics.header, saved=Saved(statistics.writer_alive, statistics.complete))
    content = STATISTICS.encode(header.as_json(), len(statistics.cells)) + bytes(statistics.cells)
    try:
        keep_file(path, content)
    except OSError as error:
        fault = f"{path}: the statistics cannot be kept there ({error.strerror})"
        raise StatisticsFileError(fault, expected="a file that this user may write") from error


def _is_a_run_s_own(path: Path) -> bool:
    try:
        with STATISTICS.opened(path) as file:
            return "saved" not in file.header
    except StatisticsFileError:
        return False


class StatisticsFile:
    """The writing end: `cells`, and the sequence around them.

    `header` holds `models` (by path: `kind`, `period_ns`, `tolerance_ns`, `policy`), `conditions`
    and `clock_speed`; the writing process and the layout join it. Raises StatisticsFileError when
    it cannot be made.
    """

    def __init__(self, layout: Layout, header: Mapping[str, Any], path: Path | None = None) -> None:
        self.layout = layout
        stated = {**header, "writer": this_process(), "layout": layout}
        self.header = convert(stated, Header, from_attributes=True)
        self.cells: Cells = STATISTICS.create(path, self.header.as_json(), layout.cells)
        self.sequence = 0

    def open_section(self) -> None:
        """Make the sequence odd: what follows belongs together.

        It stays odd where an exception has left a section open.
        """
        self.cells[SEQUENCE] = self.sequence + 1

    def close_section(self, now: int) -> None:
        """Note the instant and the heartbeat, then make the sequence even.

        The heartbeat is the instant of CLOCK_MONOTONIC up to which logical time has caught up with
        the clock. After a step it may be behind: see `executive.ledger`.
        """
        cells = self.cells
        cells[ELAPSED] = now
        cells[HEARTBEAT] = monotonic_ns()
        self.sequence = cells[SEQUENCE] = self.sequence + 2

    def close_section_as_it_was(self) -> None:
        """Make the sequence even; instant and heartbeat stay, for nothing of the run has passed."""
        self.sequence = self.cells[SEQUENCE] = self.sequence + 2

    def statistics(self) -> Statistics:
        """A copy of what has been counted so far."""
        copy = memoryview(bytearray(self.cells)).cast("q")
        count_overdue(copy, self.header, is_alive=True)
        return Statistics(self.header, copy)
