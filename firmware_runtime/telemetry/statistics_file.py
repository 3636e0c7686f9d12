"""The statistics file: counters of a run in shared memory, written without a system call.

How it works. The file is

    magic (8 bytes) | schema | length of the file | length of the header, each 64 bits
    header: JSON with the names, the layout and the conditions, padded to a multiple of 8
    cells: signed 64-bit integers, placed as `layout` says

and is mapped once, before the run. After that a counter is a store to memory. Cells that belong
together are written between `open_section` and `close_section`, which make the first cell, the
sequence, odd and even again: a reader that sees the same even number before and after its copy has
copied no half of a section. There is no lock, so a reader can neither delay nor stop the writer,
and the pages belong to the kernel, so they outlive the process, kill -9 included.

The file appears under its name complete, by renaming. Its space is allocated at once, so that a
full disk refuses the run instead of killing it later. Without a path the memory is anonymous.
"""

import json
import mmap
import os
import struct
from collections.abc import Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Any

from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.histogram import Cells
from firmware_runtime.telemetry.layout import ELAPSED, HEARTBEAT, SEQUENCE, Layout
from firmware_runtime.telemetry.process_identity import this_process
from firmware_runtime.telemetry.statistics import SCHEMA, Statistics

MAGIC = b"FWRTSTAT"
PREFIX = struct.Struct("=8s3q")
MODE = 0o640
"""The owner writes, the group may read: a robot's operators need not be root."""


class StatisticsFile:
    """The writing end: `cells`, and the sequence around them.

    `header` holds `models` (by path: `period_ns`, `tolerance_ns`, `policy`) and `conditions`; the
    writing process and the layout join it. Raises StatisticsFileError when it cannot be made.
    """

    def __init__(self, layout: Layout, header: Mapping[str, Any], path: Path | None = None) -> None:
        self.layout = layout
        self.header = {**header, "writer": this_process(), "layout": layout.describe()}
        encoded = _encode(self.header)
        first = PREFIX.size + len(encoded)
        size = first + 8 * layout.cells
        start = PREFIX.pack(MAGIC, SCHEMA, size, len(encoded)) + encoded
        memory = mmap.mmap(-1, size) if path is None else _publish(path, size, start)
        self.cells: Cells = memoryview(memory)[first:].cast("q")

    def open_section(self) -> None:
        """Make the sequence odd: what follows belongs together.

        It stays odd where an exception has left a section open.
        """
        self.cells[SEQUENCE] |= 1

    def close_section(self, now: int) -> None:
        """Note the instant and a heartbeat (CLOCK_MONOTONIC), then make the sequence even."""
        cells = self.cells
        cells[ELAPSED] = now
        cells[HEARTBEAT] = monotonic_ns()
        cells[SEQUENCE] += 1

    def statistics(self) -> Statistics:
        """A copy of what has been counted so far."""
        copy = memoryview(bytes(self.cells)).cast("q")
        return Statistics(self.header, self.layout, copy)


def _encode(header: Mapping[str, Any]) -> bytes:
    """JSON, padded so that the cells behind it are aligned."""
    encoded = json.dumps(header, separators=(",", ":")).encode()
    return encoded + b" " * (-len(encoded) % 8)


def _publish(path: Path, size: int, start: bytes) -> mmap.mmap:
    """Make the file under a name of its own, fill and map it, then give it the name people know."""
    unfinished = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.unlink(missing_ok=True)
        descriptor = os.open(unfinished, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, MODE)
        try:
            os.fchmod(descriptor, MODE)
            os.posix_fallocate(descriptor, 0, size)
            os.pwrite(descriptor, start, 0)
            memory = mmap.mmap(descriptor, size)
            unfinished.replace(path)
        finally:
            os.close(descriptor)
            unfinished.unlink(missing_ok=True)
    except OSError as error:
        fault = f"{path}: the statistics file cannot be made ({error.strerror})"
        raise StatisticsFileError(
            f"{fault}; expected a directory that this user may write"
        ) from error
    return memory
