"""A serial port that any program opens by its path, with a double at the other end.

    with SerialPty(SabertoothDouble(monotonic_ns), monotonic_ns) as line:
        Sabertooth(line.path).drive(1, 50)
        assert line.until(lambda: double.motors.speeds_rad_s(now())[0] > 0)

A thread moves the bytes, a few milliseconds after they were written. A test that looks at what they
did waits until they are there (`settle`) or for what it looks for (`until`), so that it never
depends on how busy the machine is.
"""

import os
import threading
import tty
from collections.abc import Callable
from select import select
from typing import Any, Final

from firmware_runtime.system.resources import Closing, WakeUp
from sim_doubles.clock import Now
from sim_doubles.serial_line import SerialTarget

CHUNK: Final = 4096
LONGEST_WAIT_S: Final = 0.005
"""Greatest delay of what a double sends by itself."""
BOUND_S: Final = 10.0
"""Bound of a wait for the thread, on a machine however busy."""


class PtySerialLine:
    """A pseudo-terminal in raw mode with a target behind it; programs open `path` as their port.

    There is no thread: the line's owner calls `pump`, when `fileno` is readable for bytes from
    the host, and as often as the target's own bytes are wanted. Programs may open and close the
    path as they like; `lost` counts bytes that were not fetched in time.
    """

    def __init__(self, target: SerialTarget, now: Now) -> None:
        self.lost = 0
        self._target = target
        self._now = now
        self._line, self._port = os.openpty()  # the port stays open, or the line would hang up
        tty.setraw(self._port)
        os.set_blocking(self._line, False)
        self.path = os.ttyname(self._port)
        target.transmitted(now())

    def fileno(self) -> int:
        """Return the descriptor to select on: readable when the host has written."""
        return self._line

    def pump(self) -> None:
        """Move all bytes that are waiting, both ways; never blocks."""
        while received := self._received():
            self._target.receive(received)
        self._send(self._target.transmitted(self._now()))

    def write_as_host(self, data: bytes) -> None:
        """Send bytes to the target as a program that has opened the path does."""
        os.write(self._port, data)

    def close(self) -> None:
        """Take the path away; the target goes on as it is."""
        os.close(self._line)
        os.close(self._port)

    def _received(self) -> bytes:
        try:
            return os.read(self._line, CHUNK)
        except BlockingIOError:
            return b""

    def _send(self, data: bytes) -> None:
        try:
            taken = os.write(self._line, data)
        except BlockingIOError:
            taken = 0
        self.lost += len(data) - taken


class SerialPty(Closing):
    """A pseudo-terminal with a double behind it, from construction until `close`."""

    def __init__(self, target: SerialTarget, now: Now) -> None:
        self.double: Any = target
        self.now = now
        self._marked = _MarkedTarget(target)
        self._line = PtySerialLine(self._marked, now)
        self._moved = threading.Condition()
        self._wake_up = WakeUp()
        self._thread = threading.Thread(target=self._serve, name=self._line.path, daemon=True)
        self._is_closed = False
        self._thread.start()

    @property
    def path(self) -> str:
        """Return the path that a program opens: /dev/pts/N."""
        return self._line.path

    def until(self, condition: Callable[[], object], timeout_s: float = BOUND_S) -> bool:
        """Wait until a condition holds, looked at whenever bytes were moved; False if never."""
        with self._moved:
            return bool(self._moved.wait_for(condition, timeout_s))

    def settle(self) -> None:
        """Wait until the double has all that was written by now, and the host what it sent.

        Raises TimeoutError after ten seconds.
        """
        if not self._thread.is_alive():
            return
        with self._moved:
            self._line.write_as_host(self._marked.mark())
        if not self.until(lambda: not self._marked.waits):
            raise TimeoutError(f"{self.path}: bytes did not arrive, expected them within 10 s")

    def close(self) -> None:
        """Disconnect and take the path away; twice is harmless."""
        self.disconnect()
        if not self._is_closed:
            self._is_closed = True
            self._wake_up.close()
            self._line.close()

    def disconnect(self) -> None:
        """End the thread; the path stays, and what is written to it gets nowhere."""
        if self._thread.is_alive():
            self._wake_up.ring()
            self._thread.join()

    def _serve(self) -> None:
        waited_for = [self._line.fileno(), self._wake_up.fileno()]
        while self._wake_up.fileno() not in select(waited_for, [], [], LONGEST_WAIT_S)[0]:
            with self._moved:
                self._line.pump()
                self._moved.notify_all()


class _MarkedTarget(SerialTarget):
    """Passes on what it receives, without the mark that says that all before it has come."""

    def __init__(self, target: SerialTarget) -> None:
        self._target = target
        self._mark = b""
        self._held = b""

    @property
    def waits(self) -> bool:
        """Return whether a mark is under way."""
        return bool(self._mark)

    def mark(self) -> bytes:
        """Return bytes that occur in no traffic; what comes is held until they have."""
        self._mark = os.urandom(16)
        return self._mark

    def receive(self, data: bytes) -> None:
        self._held += data
        if self._mark not in self._held:
            return
        before, after = self._held.split(self._mark, 1) if self._mark else (self._held, b"")
        self._held = self._mark = b""
        self._target.receive(before)
        if after:
            self._target.receive(after)

    def transmitted(self, at: int) -> bytes:
        return self._target.transmitted(at)

    def power_cycle(self) -> None:
        self._target.power_cycle()
