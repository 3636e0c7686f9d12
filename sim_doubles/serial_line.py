"""A serial line of doubles, in process: a port that a driver speaks to.

Bytes reach a target at the instant they are written, as if they took no time on the wire; drivers
count their waits from when they have left all the same (`hal.accounted_port`). What a target sends
arrives at the pace the target gives it. Not modelled: the host's baud rate, so a wrong one does no
harm; an output buffer that fills, an input buffer that overflows.

A line is opened by making it: what the target sent before is lost, as on a closed port.

A target is a device at the other end, as the line sees it: bytes in, bytes out.
"""

from abc import ABC, abstractmethod
from collections import deque
from typing import NamedTuple

from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusFault, PortClosed
from sim_doubles.clock import Now


class SerialTarget(ABC):
    """Anything with a serial port of its own; what it sends by itself is worked out when read."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take bytes from the host, now."""

    @abstractmethod
    def transmitted(self, at: int) -> bytes:
        """Return the bytes whose last bit is out by `at` and that were not returned before."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose supply and get it back: everything volatile is at its power-up value."""


__all__ = ["SerialLineDouble", "SerialTarget", "Traffic"]


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
