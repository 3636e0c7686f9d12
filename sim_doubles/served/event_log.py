"""A log of what happened to a server of doubles: JSON lines, each out at once."""

from pathlib import Path

import msgspec

from firmware_runtime.system.resources import Closing
from sim_doubles.served.errors import ServingError

_encode = msgspec.json.Encoder().encode


class EventLog(Closing):
    """Writes a line for each event; a context manager that closes it.

    Raises ServingError if the file cannot be made or written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file = path.open("wb", buffering=0)
        except OSError as error:
            raise self._unwritable(error) from error

    def event(self, at: int, what: str, **details: object) -> None:
        """Write what happened to the server."""
        self._write({"t_ns": at, "event": what, **details})

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, line: dict[str, object]) -> None:
        try:
            self._file.write(_encode(line) + b"\n")
        except OSError as error:
            raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> ServingError:
        return ServingError(
            f"{self._path}: the log cannot be written ({error.strerror}); expected a file that can"
        )
