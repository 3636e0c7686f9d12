"""A serial port that knows when what it was given has left: the one drivers are given.

A port takes bytes at once and sends them at its own pace, ten bits each with start and stop. So the
lines' time does not go on by them; what a device waits for is counted from when the last has left.
"""

from firmware_runtime.hal.budget import wire_ns
from firmware_runtime.hal.line_time import LineTime
from firmware_runtime.hal.serial import SerialPort

BITS_PER_BYTE = 10


class TimedPort(SerialPort):
    """Any port at a baud rate, in the time of the lines of this run; it changes no byte."""

    def __init__(self, port: SerialPort, baud: int, time: LineTime) -> None:
        self.name = port.name
        self._port = port
        self._baud = baud
        self._time = time
        self._sent_at = 0

    def write(self, data: bytes) -> None:
        """Hand all bytes to the port; they leave one after the other."""
        self._port.write(data)
        begins_at = max(self._sent_at, self._time())
        self._sent_at = begins_at + wire_ns(BITS_PER_BYTE * len(data), self._baud)

    def read_available(self) -> bytes:
        """Take what has arrived."""
        return self._port.read_available()

    def discard_input(self) -> None:
        """Throw away what has arrived."""
        self._port.discard_input()

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way until what was written has left."""
        return self._time.elapsed() + max(0, self._sent_at - self._time())

    def close(self) -> None:
        """Close the port underneath."""
        self._port.close()
