"""The traces of both ends as one, by time of origin.

A line is one of an end's trace with its end added: `{"t_ns": ..., "end": "robot", "port": ...,
"value": ...}`; `t_ns` counts from the start of the end that began first.
"""

import heapq
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from firmware_runtime.errors import TraceFileError


def merge_traces(traces: Mapping[str, Path], began: Mapping[str, int], into: Path) -> None:
    """Write one file of several, each of which is in order. Raises TraceFileError."""
    zero = min(began.values(), default=0)
    lines = [
        _lines(role, path, began.get(role, zero) - zero)
        for role, path in traces.items()
        if path.exists()
    ]
    with _written(into) as file:
        for line in heapq.merge(*lines, key=lambda each: each["t_ns"]):
            file.write(f"{json.dumps(line)}\n")


def begin_trace(into: Path) -> None:
    """Make the file empty before anything runs. Raises TraceFileError."""
    with _written(into):
        pass


@contextmanager
def _written(path: Path) -> Iterator[TextIO]:
    """A file to write; raises TraceFileError where it cannot be."""
    try:
        with path.open("w") as file:
            yield file
    except OSError as error:
        fault = f"{path}: the trace cannot be written ({error.strerror})"
        raise TraceFileError(fault, expected="a file that can be made") from error


def _lines(role: str, path: Path, offset: int) -> Iterator[dict[str, Any]]:
    """An end's lines; the last one of a run that was killed may be cut off, and is left out."""
    with path.open() as file:
        for line in file:
            if line.endswith("\n"):
                found = json.loads(line)
                yield {"t_ns": found.pop("t_ns") + offset, "end": role, **found}
