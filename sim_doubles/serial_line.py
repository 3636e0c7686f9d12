"""Serial lines of doubles: in process as a port a driver speaks to, or as a real pseudo-terminal.

Bytes reach a target at the instant they are written, as if they took no time on the wire; drivers
count their waits from when they have left all the same (`hal.timed_port`). What a target sends
arrives at the pace the target gives it. Not modelled: the host's baud rate, so a wrong one does no
harm; an output buffer that fills, an input buffer that overflows.

A line is opened by making it: what the target sent before is lost, as on a closed port.
"""

import os
import tty
from collections import deque
from typing import NamedTuple

from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusFault, PortClosed
from sim_doubles.clock import Now
from sim_doubles.serial_target import SerialTarget

__all__ = ["PtySerialLine", "SerialLineDouble", "SerialTarget", "Traffic"]

CHUNK = 4096


class Traffic(NamedTuple):
    """One logged write to the target, or one read that was not empty."""

    at: int
    written: bool
    data: bytes

    def __str__(self) -> str:
        """Direction and bytes, for people: `W 80 00 3f 3f`."""
        return f"{'W' if self.written else 'R'} {self.data.hex(' ')}"


class SerialLineDouble(SerialPort):
    """A port by its name with one target at the other end.

    `log` keeps the last `log_length` writes and reads. Faults: `unplugged` True is a USB adapter
    pulled out, every use raises BusFault; `cut` and `reconnect` part and join the wires, which no
    port notices.
    """

    def __init__(self, name: str, now: Now, target: SerialTarget, *, log_length: int = 256) -> None:
        self.name = name
        self.unplugged = False
        self.log: deque[Traffic] = deque(maxlen=log_length)
        self._now = now
        self._target = target
        self._arrived = b""
        self._cut = self._closed = False
        target.transmitted(now())

    def write(self, data: bytes) -> None:
        """Send bytes to the target. Raises PortClosed, or BusFault without an adapter."""
        self._check()
        self.log.append(Traffic(self._now(), written=True, data=bytes(data)))
        if not self._cut:
            self._target.receive(bytes(data))

    def read_available(self) -> bytes:
        """Take what has arrived by now. Raises PortClosed, or BusFault without an adapter."""
        self._check()
        self._fetch()
        data, self._arrived = self._arrived, b""
        if data:
            self.log.append(Traffic(self._now(), written=False, data=data))
        return data

    def close(self) -> None:
        """Release the port; the target goes on as it is."""
        self._closed = True

    def cut(self) -> None:
        """Part the wires: from now on bytes are lost, both ways."""
        self._fetch()
        self._cut = True

    def reconnect(self) -> None:
        """Join the wires; what was sent in between is lost."""
        self._fetch()
        self._cut = False

    def _fetch(self) -> None:
        sent = self._target.transmitted(self._now())
        if not self._cut:
            self._arrived += sent

    def _check(self) -> None:
        if self._closed:
            raise PortClosed("used after it was closed", where=self.name)
        if self.unplugged:
            raise BusFault("the adapter is gone", where=self.name)


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
