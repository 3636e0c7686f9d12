"""A serial port that counts what it carries and knows when it has left: the one drivers are given.

A port takes bytes at once and sends them at its own pace. So the lines' time does not go on by
them; what a device waits for is counted from when the last has left.
"""

from firmware_runtime.hal.budget import LineTime, wire_ns
from firmware_runtime.hal.serial import BITS_PER_BYTE, SerialPort
from firmware_runtime.hal.wire_errors import HalError


class AccountedPort(SerialPort):
    """Any port at a baud rate, in the time of the lines of this run; it changes no byte.

    Its counters only grow, from when it was opened. `writes`, `bytes_written` and `writing_ns` are
    of what the port took, `bytes_read` and `reading_ns` of what was taken from it, `errors` of the
    calls that failed. Both times are those of the bytes on the line: computed, not measured. How
    much of a write that failed has left is not known, nor how much input was thrown away: both are
    in no count.
    """

    def __init__(self, port: SerialPort, baud: int, time: LineTime) -> None:
        self.name = port.name
        self.writes = 0
        self.bytes_written = 0
        self.bytes_read = 0
        self.errors = 0
        self.writing_ns = 0
        self.reading_ns = 0
        self._port = port
        self._baud = baud
        self._time = time
        self._sent_at = 0

    def write(self, data: bytes) -> None:
        """Hand all bytes to the port; they leave one after the other."""
        try:
            self._port.write(data)
        except HalError:
            self.errors += 1
            raise
        takes = wire_ns(BITS_PER_BYTE * len(data), self._baud)
        self.writes += 1
        self.bytes_written += len(data)
        self.writing_ns += takes
        self._sent_at = max(self._sent_at, self._time()) + takes

    def read_available(self) -> bytes:
        """Take what has arrived."""
        try:
            arrived = self._port.read_available()
        except HalError:
            self.errors += 1
            raise
        if arrived:
            self.bytes_read += len(arrived)
            self.reading_ns += wire_ns(BITS_PER_BYTE * len(arrived), self._baud)
        return arrived

    def discard_input(self) -> None:
        """Throw away what has arrived."""
        try:
            self._port.discard_input()
        except HalError:
            self.errors += 1
            raise

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way until what was written has left."""
        return self._time.elapsed() + max(0, self._sent_at - self._time())

    def close(self) -> None:
        """Close the port underneath; the counters stay readable."""
        self._port.close()
