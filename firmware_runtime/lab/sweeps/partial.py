"""Rows that are finished, beside the table to come: kept as they come, found again by `--resume`.

The first line says which plan they are of, such as a sweep; each further line is one row, in JSON.
A last line that was cut short by a kill is left out.
"""

from collections.abc import Iterator
from contextlib import suppress
from fcntl import LOCK_EX, LOCK_NB, flock
from io import FileIO
from os import SEEK_END
from pathlib import Path
from typing import Any, Protocol

import msgspec

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.statistics.json_values import NOT_JSON
from firmware_runtime.system.resources import Closing


class Plan(Protocol):
    """What the rows are of: a sweep, or a campaign; a Struct."""

    def command(self) -> Iterator[str]:
        """Yield the words of its command."""


class _First(msgspec.Struct, frozen=True):
    """The first line."""

    plan: Any
    version: str


def partial_of(output: Path) -> Path:
    """Return where the rows of a table to come are kept."""
    return output.with_name(f"{output.name}.partial")


class Partial(Closing):
    """The rows finished so far of one plan; `rows` are those found. Raises ConfigError."""

    def __init__(self, path: Path, plan: Plan, version: str, *, resume: bool) -> None:
        self.path = path
        self.rows: dict[int, Row] = {}
        first = _First(plan, version)
        lines = _lines(path) if resume else []
        if lines:
            _check(path, lines[0], first)
            self.rows = dict(_numbered(path, line) for line in lines[1:])
        elif path.exists() and not resume:
            raise _unfinished(path)
        try:
            self._file = path.open("r+b" if lines else "ab", buffering=0)
            _lock(path, self._file)
            self._file.truncate(sum(len(line) + 1 for line in lines))
            self._file.seek(0, SEEK_END)
        except OSError as error:
            fault = f"{path}: {error.strerror}; expected a folder that can be written"
            raise ConfigError.of_one("-o", fault) from error
        self._has_rows = bool(self.rows)
        if not lines:
            self._write(msgspec.json.encode(first) + b"\n")

    def keep(self, row: Row) -> None:
        """Keep a row; it is there whatever happens to this process next."""
        self._has_rows = True
        self._write(msgspec.json.encode(row) + b"\n")

    def close(self) -> None:
        """Stop keeping rows; those that are kept stay, and without any the file goes."""
        if not self._file.closed and not self._has_rows:
            self.path.unlink(missing_ok=True)
        self._file.close()

    def remove(self) -> None:
        """The table is there: these rows are not needed any more."""
        self.close()
        self.path.unlink(missing_ok=True)

    def _write(self, content: bytes) -> None:
        left = memoryview(content)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError as error:
            fault = f"{self.path}: {error.strerror}; expected room for more rows, then --resume"
            raise ConfigError.of_one("-o", fault) from error


def _unfinished(path: Path) -> ConfigError:
    """Return the error for rows that are there. Raises ConfigError while a sweep writes them."""
    with suppress(OSError), path.open("rb", buffering=0) as file:
        _lock(path, file)
    fault = f"{path} is of one that did not end; expected --resume, or that it is gone"
    return ConfigError.of_one("-o", fault)


def _lock(path: Path, file: FileIO) -> None:
    """Keep others out until the file is closed. Raises ConfigError while one is at it."""
    try:
        flock(file, LOCK_EX | LOCK_NB)
    except BlockingIOError as error:
        file.close()
        fault = f"{path}: another one writes it; expected one at a time"
        raise ConfigError.of_one("-o", fault) from error


def _lines(path: Path) -> list[bytes]:
    """The whole lines of the file, if there is one. Raises ConfigError."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return []
    except OSError as error:
        raise ConfigError.of_one("--resume", f"{path}: {error.strerror}") from error
    return content.split(b"\n")[:-1]


def _numbered(path: Path, line: bytes) -> tuple[int, Row]:
    """Return a row and its number. Raises ConfigError for what is none."""
    try:
        row = msgspec.json.decode(line, type=dict[str, Any])
        return msgspec.convert(row.get("row"), int), row
    except NOT_JSON as error:
        fault = f"{path}: a line is no finished row ({error}); expected it as it was left"
        raise ConfigError.of_one("--resume", fault) from error


def _check(path: Path, line: bytes, first: _First) -> None:
    """Refuse rows of another plan."""
    try:
        found = msgspec.json.decode(line, type=_First)
        plan: Plan = msgspec.convert(found.plan, type(first.plan))
    except NOT_JSON as error:
        fault = f"{path}: no finished rows of this command ({error})"
        raise ConfigError.of_one("--resume", fault) from error
    if (plan, found.version) != (first.plan, first.version):
        words = " ".join([*plan.command(), f"with version {found.version}"])
        fault = f"{path} is of another one; expected {words}, as it began"
        raise ConfigError.of_one("--resume", fault)
