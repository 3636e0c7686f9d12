"""The reading end of a statistics file, for any process that may read it, at any time.

A copy is good when the sequence was even, and the same, before and after it. Python has no memory
barrier, so on a processor that reorders stores the sequence could become visible before the cells
it guards, or after: the reader therefore waits on both sides of the copy, thousands of times longer
than a store stays in a processor's store buffer.
"""

from pathlib import Path
from time import sleep

from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.layout import Layout
from firmware_runtime.telemetry.mapped_file import ReadableFile
from firmware_runtime.telemetry.process_identity import is_running
from firmware_runtime.telemetry.statistics import Statistics
from firmware_runtime.telemetry.statistics_file import STATISTICS

SETTLE_S = 50e-6
ATTEMPTS = 2_000
"""Together 0.2 s; a section takes microseconds, only a stopped writer keeps one open for long."""
_SEQUENCE_BYTES = 8


def read_statistics(path: Path) -> Statistics:
    """Copy a run's statistics, during the run or after its end, however it ended.

    Raises StatisticsFileError when there is no such file, when it is not a statistics file of this
    version, when it is cut short, or when a living writer keeps it half written for 0.2 s.
    """
    with STATISTICS.opened(path) as file:
        return _read(file)


def _read(file: ReadableFile) -> Statistics:
    header = file.header
    try:
        layout = Layout.from_description(header["layout"])
        is_running(header["writer"])
        for path in layout.models:
            stated = header["models"][path]
            _ = stated["period_ns"] + stated["tolerance_ns"], stated["policy"]
        _ = header["conditions"].keys()
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise file.damaged(f"its header has no usable {error}") from error
    if 8 * layout.cells != file.cell_bytes:
        raise file.damaged(f"{file.cell_bytes} bytes of cells, expected {8 * layout.cells}")
    for _ in range(ATTEMPTS):
        alive = is_running(header["writer"])  # asked before: what a dead writer left stays as it is
        cells, complete = _copy(file)
        if complete or not alive:
            return Statistics(header, layout, memoryview(cells).cast("q"), alive, complete)
    raise StatisticsFileError(
        f"{file.path}: process {header['writer']['pid']} keeps the file half written; "
        "expected a section of a few microseconds, the process may be stopped"
    )


def _copy(file: ReadableFile) -> tuple[bytes, bool]:
    """The cells, and whether no section was open while they were copied."""
    before = file.read(0, _SEQUENCE_BYTES)
    sleep(SETTLE_S)
    cells = file.read()
    sleep(SETTLE_S)
    after = file.read(0, _SEQUENCE_BYTES)
    even = memoryview(after).cast("q")[0] % 2 == 0
    return cells, even and before == after
