"""Double of the Brook. Source: example, rev. 1. Nothing of the driver's is used here.

Modelled: both commands, checks, the time of an answer and of its bytes. Not modelled: the rate that
the host has set, noise on the line.
"""

from collections.abc import Callable

from sim_doubles.altered_readings import AlteredReadings
from sim_doubles.clock import Now
from sim_doubles.serial_line import SerialTarget

BYTE_NS = 10 * 1_000_000_000 // 9600
THINKS_NS = 20_000_000


class BrookDouble(SerialTarget):
    """A Brook; `flow_l_s` is the flow at an instant, in l/s."""

    def __init__(self, now: Now, flow_l_s: Callable[[int], float] = lambda _: 0.25) -> None:
        self.warnings: list[str] = []
        self.readings = AlteredReadings(0, 0xFFFF)
        self._now = now
        self._flow_l_s = flow_l_s
        self.power_cycle()

    def power_cycle(self) -> None:
        """Lose supply and get it back: what was asked is forgotten."""
        self._asked = b""
        self._leaving: list[tuple[int, int]] = []

    def receive(self, data: bytes) -> None:
        """Take questions; what is none is skipped, byte by byte."""
        self._asked += data
        while len(self._asked) >= 3:
            start, command, check = self._asked[:3]
            if start != 0x3A or command + check != 0xFF:
                self.warnings.append(f"byte 0x{start:02x}, which begins no question")
                self._asked = self._asked[1:]
                continue
            self._asked = self._asked[3:]
            if command == 0x49:
                self._send(command, 0x4252)
            elif command == 0x46:
                measured = round(self._flow_l_s(self._now()) * 1000)
                self._send(command, self.readings.altered(measured))
            else:
                self.warnings.append(f"command 0x{command:02x}, which it does not have")

    def transmitted(self, at: int) -> bytes:
        """Return the bytes whose last bit is out by `at`."""
        out = bytes(byte for left, byte in self._leaving if left <= at)
        self._leaving = [each for each in self._leaving if each[0] > at]
        return out

    def _send(self, command: int, number: int) -> None:
        high, low = divmod(number, 256)
        left = self._now() + THINKS_NS
        for byte in (0x3A, command, high, low, 255 - (command + high + low) % 256):
            left += BYTE_NS
            self._leaving.append((left, byte))
