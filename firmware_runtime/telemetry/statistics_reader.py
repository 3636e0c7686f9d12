"""The reading end of a statistics file, for any process that may read it, at any time.

A copy is good when the sequence was even, and the same, before and after it. Python has no memory
barrier, so on a processor that reorders stores the sequence could become visible before the cells
it guards, or after: the reader therefore waits on both sides of the copy, thousands of times longer
than a store stays in a processor's store buffer. It reads with `pread`, never through a mapping: a
file that is cut short while it is read cannot kill the reader.
"""

import json
import os
import struct
from pathlib import Path
from time import sleep
from typing import Any

from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.layout import Layout
from firmware_runtime.telemetry.process_identity import is_running
from firmware_runtime.telemetry.statistics import SCHEMA, Statistics
from firmware_runtime.telemetry.statistics_file import MAGIC, PREFIX

SETTLE_S = 50e-6
ATTEMPTS = 2_000
"""Together 0.2 s; a section takes microseconds, only a stopped writer keeps one open for long."""
_SEQUENCE = struct.Struct("=q")


def read_statistics(path: Path) -> Statistics:
    """Copy a run's statistics, during the run or after its end, however it ended.

    Raises StatisticsFileError when there is no such file, when it is not a statistics file of this
    version, when it is cut short, or when a living writer keeps it half written for 0.2 s.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        fault = f"{path}: the statistics file cannot be read ({error.strerror})"
        raise StatisticsFileError(f"{fault}; expected a run to have written it") from error
    try:
        return _read(path, descriptor)
    finally:
        os.close(descriptor)


def _read(path: Path, descriptor: int) -> Statistics:
    header, first, size = _read_header(path, descriptor)
    try:
        layout = Layout.from_description(header["layout"])
        is_running(header["writer"])
    except (KeyError, TypeError, ValueError) as error:
        raise _damaged(path, f"its header has no usable {error}") from error
    if 8 * layout.cells != size - first:
        raise _damaged(path, f"{size - first} bytes of cells, expected {8 * layout.cells}")
    for _ in range(ATTEMPTS):
        alive = is_running(header["writer"])  # asked before: what a dead writer left stays as it is
        cells, complete = _copy(path, descriptor, first, size)
        if complete or not alive:
            return Statistics(header, layout, memoryview(cells).cast("q"), alive, complete)
    raise StatisticsFileError(
        f"{path}: process {header['writer']['pid']} keeps the file half written; "
        "expected a section of a few microseconds, the process may be stopped"
    )


def _read_header(path: Path, descriptor: int) -> tuple[dict[str, Any], int, int]:
    """The header, the first byte of the cells, and the length of the file."""
    prefix = os.pread(descriptor, PREFIX.size, 0)
    if prefix[: len(MAGIC)] != MAGIC:
        raise _damaged(path, f"it starts with {prefix[:8]!r}, expected {MAGIC!r}")
    if len(prefix) < PREFIX.size:
        raise _damaged(path, f"{len(prefix)} bytes, expected at least {PREFIX.size}")
    _, schema, size, header_size = PREFIX.unpack(prefix)
    if schema != SCHEMA:
        raise StatisticsFileError(f"{path}: schema {schema}; this program reads schema {SCHEMA}")
    actual = os.fstat(descriptor).st_size
    if actual != size:
        raise _damaged(path, f"{actual} bytes, expected {size}")
    first = PREFIX.size + header_size
    try:
        header = json.loads(os.pread(descriptor, header_size, PREFIX.size))
    except ValueError as error:
        raise _damaged(path, f"its header is not JSON ({error})") from error
    return header, first, size


def _copy(path: Path, descriptor: int, first: int, size: int) -> tuple[bytes, bool]:
    """The cells, and whether no section was open while they were copied."""
    before = os.pread(descriptor, _SEQUENCE.size, first)
    sleep(SETTLE_S)
    cells = os.pread(descriptor, size - first, first)
    sleep(SETTLE_S)
    after = os.pread(descriptor, _SEQUENCE.size, first)
    if len(cells) != size - first:
        raise _damaged(path, f"cut to {first + len(cells)} bytes while read, expected {size}")
    even = _SEQUENCE.unpack(after)[0] % 2 == 0
    return cells, even and before == after


def _damaged(path: Path, fault: str) -> StatisticsFileError:
    return StatisticsFileError(f"{path}: not a whole statistics file: {fault}")
