"""A trace as JSON lines, for other programs: `{"t_ns": ..., "port": "path.port", "value": ...}`.

Numbers, texts, true, false and null are themselves; tuples, lists and numpy arrays are arrays;
named tuples, dataclasses, structs and dictionaries are objects; a member of an enumeration is its
name.
JSON has no word for numbers that are not finite: they are the texts "nan", "inf" and "-inf".
Anything else is the text that `str` makes of it.
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import msgspec

from firmware_runtime.closing import Closing
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.trace import trace
from firmware_runtime.statistics.errors import TraceFileError, TraceNotWholeError

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
            raise TraceFileError(f"{fault}; expected a file that can be made") from error

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
                f"{self._path}: the trace ends early ({self._failure.strerror}); expected room for "
                "all of it; the run went on to its end"
            ) from self._failure


def plain(value: object) -> Any:  # noqa: ANN401 -- whatever JSON can say
    """The value in JSON's types."""
    to_list = getattr(value, "tolist", None)  # numpy's types have it; numpy takes long to import
    if to_list is not None:
        value = to_list()
    elif isinstance(value, Enum):
        value = value.name
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, int | str | None):
        return value
    named = _named(value)
    if named is not None:
        return {name: plain(each) for name, each in named}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return str(value)


def _named(value: object) -> Iterable[tuple[str, object]] | None:
    """Names and values of what becomes an object, else None."""
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return zip(value._fields, value, strict=True)
    if is_dataclass(value) and not isinstance(value, type):
        return ((field.name, getattr(value, field.name)) for field in fields(value))
    if isinstance(value, msgspec.Struct):
        return ((name, getattr(value, name)) for name in value.__struct_fields__)
    if isinstance(value, dict):
        return ((str(key), each) for key, each in value.items())
    return None


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
