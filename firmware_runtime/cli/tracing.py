"""`--trace FILE`: every message of a run, while it lasts."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.trace import trace
from firmware_runtime.statistics.trace_file import TraceFile


@contextmanager
def tracing(simulator: Engine, path: Path | None) -> Iterator[None]:
    """Write what leaves every port to `path`, if there is one; raises TraceFileError."""
    if path is None:
        yield
        return
    with TraceFile(path) as file:
        trace(simulator, file.write)
        yield
