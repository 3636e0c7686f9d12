"""The log of what the outputs of served doubles did, and when: JSON lines, each out at once.

    {"t_ns": 0, "event": "serving", "board": "tachobot", "monotonic_ns": 81234567890}
    {"t_ns": 104211000, "event": "connected", "client": 1, "pid": 4711}
    {"t_ns": 853020000, "output": "thrust_pairs.3", "value": 0.5}
    {"t_ns": 2101650000, "event": "gone", "client": 1}

`t_ns` counts from the server's start, which was `monotonic_ns` on CLOCK_MONOTONIC. Every output is
0 until a line says otherwise. A PWM channel, `CHIP.CHANNEL`, is the share of time it is high; a
tread, `treads.left` or `treads.right`, is how fast its motor turns in rad/s, forward positive.

The time is the chip's, not that of writing: a step of a ramp, or a stop for want of bytes, has the
instant at which it happened, even if the server woke later.
"""

from pathlib import Path

import msgspec

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.resources import Closing
from sim_doubles.rigs.board_rig import DoublesRig

_encode = msgspec.json.Encoder().encode


class ServingError(ConfigError):
    """The socket cannot be had, or the log cannot be written."""

    def __init__(self, sentence: str) -> None:
        super().__init__("doubles", [sentence], sentence)


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


class OutputLog(EventLog):
    """Writes a line whenever an output of the rig changed; a context manager that closes it.

    Raises ServingError if the file cannot be made or written.
    """

    def __init__(self, path: Path, rig: DoublesRig) -> None:
        super().__init__(path)
        self._rig = rig
        self._at = 0
        self._levels = dict.fromkeys(rig.levels(0), 0.0)

    def catch_up(self, at: int) -> int:
        """Write what has changed up to `at`; return when the next output changes by itself."""
        while (change_at := self._rig.next_change_at(self._at)) <= at:
            self._compare(change_at)
        self._compare(at)
        return change_at

    def _compare(self, at: int) -> None:
        self._at = at
        levels = self._rig.levels(at)
        if levels != self._levels:
            for name, value in levels.items():
                if value != self._levels[name]:
                    self._write({"t_ns": at, "output": name, "value": value})
            self._levels = levels
