"""The reading end of a statistics file, for any process that may read it, at any time.

A copy is good when the sequence was even, and the same, before and after it; else it is made again.
Python has no memory barrier. On a processor that reorders stores, as Arm's do, the sequence could
become visible before the cells it guards, or after: there the reader waits on both sides of the
copy, thousands of times longer than a store stays in a processor's store buffer. On x86 stores
become visible in order.
"""

import platform
from pathlib import Path
from time import monotonic, sleep

from firmware_runtime.errors import BeingWrittenError
from firmware_runtime.statistics.comparison import counting, histograms
from firmware_runtime.statistics.file_header import STATISTICS, Header, RunState, count_overdue
from firmware_runtime.statistics.histogram import LARGEST_SUM, could_be
from firmware_runtime.statistics.layout import STATE, WORST
from firmware_runtime.statistics.mapped_file import ReadableFile
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.this_process import is_running

STORES_IN_ORDER = platform.machine() in {"x86_64", "i686"}
SETTLE_S = 50e-6
TIMEOUT_S = 1.0
"""A section takes microseconds; only a stopped writer, or one that never pauses, takes so long."""
_SEQUENCE_BYTES = 8
_MODEL_OF_PLACE = WORST.index("model")
_NOT_COUNTED = "its cells count what no run can have counted"


def read_statistics(path: Path) -> Statistics:
    """Copy a run's statistics, during the run or after its end, however it ended.

    Raises StatisticsFileError when there is no such file, when it is not a statistics file of this
    version, or when it is cut short; BeingWrittenError when a living writer keeps it half written
    for TIMEOUT_S.
    """
    with STATISTICS.opened(path) as file:
        return _read(file)


def _read(file: ReadableFile) -> Statistics:
    header = file.header_as(Header)
    expected = 8 * header.layout.cells
    if expected != file.cell_bytes:
        raise file.damaged(f"{file.cell_bytes} bytes of cells, expected {expected}")
    statistics = _copy_whole(file, header)
    if not _names_what_there_is(statistics):
        raise file.damaged("its cells name a state or a model that there is not")
    if not _counts_what_can_be(statistics):
        raise file.damaged(_NOT_COUNTED)
    return statistics


def _names_what_there_is(statistics: Statistics) -> bool:
    """Return whether the cells that stand for a name stand for one."""
    cells, layout = statistics.cells, statistics.layout
    models = [cells[layout.place(index) + _MODEL_OF_PLACE] for index in range(layout.worst)]
    return 0 <= cells[STATE] < len(RunState) and all(
        0 <= model < max(len(layout.models), 1) for model in models
    )


def _counts_what_can_be(statistics: Statistics) -> bool:
    cells, layout = statistics.cells, statistics.layout
    return all(0 <= cells[index] <= LARGEST_SUM for index in counting(layout)) and all(
        could_be(cells[part]) for part in histograms(layout)
    )


def _copy_whole(file: ReadableFile, header: Header) -> Statistics:
    """Copy until a copy is good; what a dead writer left is taken as it is."""
    if header.saved is not None:  # what held of the writer when the copy was made
        cells = memoryview(file.read()).cast("q")
        return Statistics(header, cells, header.saved.writer_alive, header.saved.complete)
    first_sequence = _sequence(file)
    alive = is_running(header.writer)
    give_up_at = monotonic() + TIMEOUT_S
    while True:
        copied, complete = _copy(file)
        if not complete and alive and monotonic() > give_up_at:
            alive = is_running(header.writer)
            if alive:
                raise _busy(file, header, stopped=_sequence(file) == first_sequence)
        elif complete or not alive:
            cells = memoryview(bytearray(copied)).cast("q")
            try:
                count_overdue(cells, header, is_alive=alive)
            except ValueError as error:  # of a cell that has no room for it
                raise file.damaged(_NOT_COUNTED) from error
            return Statistics(header, cells, alive, complete)


def _busy(file: ReadableFile, header: Header, *, stopped: bool) -> BeingWrittenError:
    writer = f"{file.path}: process {header.writer.pid}"
    if stopped:
        return BeingWrittenError(
            f"{writer} stands still and keeps the file half written",
            expected="a section of a few microseconds, the process may be stopped",
        )
    return BeingWrittenError(
        f"{writer} writes without a pause", expected="one between two steps, its loop is overloaded"
    )


def _copy(file: ReadableFile) -> tuple[bytes, bool]:
    """The cells, and whether no section was open while they were copied."""
    before = _sequence(file)
    settle()
    cells = file.read()
    settle()
    return cells, before % 2 == 0 and before == _sequence(file)


def settle() -> None:
    """Wait until every store that came before is visible, where that takes waiting."""
    if not STORES_IN_ORDER:
        sleep(SETTLE_S)


def _sequence(file: ReadableFile) -> int:
    return memoryview(file.read(0, _SEQUENCE_BYTES)).cast("q")[0]
