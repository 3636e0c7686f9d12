"""A trace as JSON lines, for other programs: `{"t_ns": ..., "port": "path.port", "value": ...}`.

How a value is written, `json_values` says.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.trace import trace
from firmware_runtime.errors import TraceFileError, TraceNotWholeError
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.system.resources import Closing

_encode = msgspec.json.Encoder().encode


class TraceFile(Closing):
    """Writes messages to a file; a context manager that closes it.

    Lines are buffered: a run that is killed loses the last few. Raises TraceFileError if the file
    cannot be made, and TraceNotWholeError at the end if it could not take everything: a full disk
    ends no run.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._failure: OSError | None = None
        try:
            self._file = path.open("wb", buffering=1 << 16)
        except OSError as error:
            fault = f"{path}: the trace cannot be written ({error.strerror})"
            raise TraceFileError(fault, expected="a file that can be made") from error

    def write(self, at: int, port: str, value: object) -> None:
        """Add one message; none after one that failed."""
        if self._failure is not None:
            return
        line = _encode({"t_ns": at, "port": port, "value": plain(value)}) + b"\n"
        try:
            self._file.write(line)
        except OSError as error:
            self._failure = error

    def close(self) -> None:
        """Close the file. Raises TraceNotWholeError if it could not take everything."""
        try:
            self._file.close()
        except OSError as error:
            self._failure = self._failure or error
        if self._failure is not None:
            raise TraceNotWholeError(
                f"the trace ends early ({self._failure.strerror})",
                where=self._path,
                expected="room for all of it; the run went on to its end",
            ) from self._failure


@contextmanager
def tracing(simulator: Engine, path: Path | None, *, at_end: bool = False) -> Iterator[None]:
    """Write what leaves every port to `path`, if there is one; raises TraceFileError.

    `at_end` keeps it in memory until then: for a run in real time that is not recorded.
    """
    if path is None:
        yield
        return
    with TraceFile(path) as file:
        if not at_end:
            trace(simulator, file.write)
            yield
            return
        kept: list[tuple[int, str, object]] = []
        trace(simulator, lambda *message: kept.append(message))
        yield
        for message in kept:
            file.write(*message)
