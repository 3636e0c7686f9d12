"""Tapped lines: buses and ports that change nothing and note every transfer and how it ended.

They stand next to the adapter or double, below retries and counters, so each attempt is noted, also
one that ended in an error which is none of a line's: of the world behind a double.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.interlock import Interlock
from firmware_runtime.hal.line_time import LineTime
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE

Transfers: TypeAlias = list[tuple[Any, ...]]
"""The fields of a `section.Transfer` each."""
Now: TypeAlias = Callable[[], int]


def how_it_failed(error: Exception) -> tuple[str, str]:
    """An error as a recording has it: its class and its sentence."""
    return type(error).__name__, str(error)


class TappedBus(I2cBus):
    """Any bus; `number` is its place among the lines."""

    def __init__(self, bus: I2cBus, number: int, transfers: Transfers, now: Now) -> None:
        self.name = bus.name
        self.returns_early = bus.returns_early
        self._bus = bus
        self._number = number
        self._transfers = transfers
        self._now = now

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry it out, and note how it ended."""
        now = self._now  # as a local, which CPython calls sooner
        try:
            answer = self._bus.transaction(address, messages)
        except Exception as error:
            failed = how_it_failed(error)
            self._transfers.append((self._number, address, tuple(messages), failed, now()))
            raise
        self._transfers.append((self._number, address, messages, answer, now()))
        return answer

    def pause(self, span: int) -> None:
        """Let time pass on the bus underneath."""
        self._bus.pause(span)

    def close(self) -> None:
        """Close the bus underneath."""
        self._bus.close()


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
