"""Tapped ports, the time of the lines and the interlock: they change nothing, and note every use.

Buses note their transactions themselves (`hal.accounted_bus`). A port stands next to the adapter or
double, below the counters, so that a use is noted that ended in an error.
"""

from collections.abc import Callable
from typing import Any, TypeAlias

from firmware_runtime.hal.budget import LineTime
from firmware_runtime.hal.interlock import Interlock
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE

Transfers: TypeAlias = list[tuple[Any, ...]]
"""The fields of a `section.Transfer` each."""
Now: TypeAlias = Callable[[], int]


def how_it_failed(error: Exception) -> tuple[str, str]:
    """An error as a recording has it: its class and its sentence."""
    return type(error).__name__, str(error)


class TappedPort(SerialPort):
    """Any serial port; `number` is its place among the lines."""

    def __init__(self, port: SerialPort, number: int, transfers: Transfers, now: Now) -> None:
        self.name = port.name
        self._port = port
        self._number = number
        self._transfers = transfers
        self._now = now

    def write(self, data: bytes) -> None:
        """Write, and note it."""
        self._noted(WRITE, bytes(data), lambda: self._port.write(data))

    def read_available(self) -> bytes:
        """Read, and note what had arrived."""
        return self._noted(READ, b"", self._port.read_available)

    def discard_input(self) -> None:
        """Throw away what has arrived, and note that."""
        self._noted(DISCARD, b"", self._port.discard_input)

    def close(self) -> None:
        """Close the port underneath."""
        self._port.close()

    def _noted(self, what: int, data: bytes, use: Callable[[], bytes | None]) -> bytes:
        try:
            answer = use() or b""
        except Exception as error:
            failed = how_it_failed(error)
            self._transfers.append((self._number, what, data, failed, self._now()))
            raise
        self._transfers.append((self._number, what, data, answer, self._now()))
        return answer


class TappedTime:
    """The time of the lines; `times` gets every instant and span that a line asks for, ns."""

    def __init__(self, time: LineTime, times: list[int]) -> None:
        self._time = time
        self._times = times

    def __call__(self) -> int:
        """Return the instant."""
        time = self._time
        self._times.append(now := time())
        return now

    def reach(self, at: int) -> None:
        """Go on to `at`."""
        self._time.reach(at)

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to where the lines are now."""
        self._times.append(elapsed := self._time.elapsed())
        return elapsed


def tapped_interlock(interlock: Interlock, answers: list[bool]) -> Interlock:
    """An interlock whose answers are appended to a list."""

    def is_enabled() -> bool:
        answers.append(enabled := interlock())
        return enabled

    return is_enabled
