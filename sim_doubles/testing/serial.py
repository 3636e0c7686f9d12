"""The serial devices of one test, each behind a port of its own.

A driver may write to its port when it is deleted (pysabertooth does), and that may be after the
test; so the last ports stay where they are for a while, with nothing at the other end.
"""

from collections import deque

from firmware_runtime.errors import ConfigError
from sim_doubles.clock import Now
from sim_doubles.serial_line import SerialTarget
from sim_doubles.serial_pty import SerialPty
from sim_doubles.testing.chips import make
from sim_doubles.testing.virtual_time import VirtualTime

_retired: deque[SerialPty] = deque()
KEPT = 16


class SerialDoubles:
    """Ports that are there from `connect` to `end`."""

    def __init__(self, clock: Now) -> None:
        self._clock = clock
        self._lines: list[SerialPty] = []

    def connect(self, device: str | SerialTarget, **settings: object) -> SerialPty:
        """Put a device behind a port, by its name or as a double. Raises ConfigError."""
        double = make(device, self._clock, **settings) if isinstance(device, str) else device
        if not isinstance(double, SerialTarget):
            raise ConfigError(str(device), ["not a serial device; expected the fixture i2c_double"])
        line = SerialPty(double, self._clock)
        self._lines.append(line)
        if isinstance(self._clock, VirtualTime):
            self._clock.settles.append(line.settle)
        return line

    def warnings(self) -> list[str]:
        """Return warnings about what a real device would not take as meant."""
        return [warning for line in self._lines for warning in getattr(line.double, "warnings", ())]

    def end(self) -> None:
        """Disconnect every port, and take those away that a few tests had no more use for."""
        for line in self._lines:
            line.disconnect()
        _retired.extend(self._lines)
        while len(_retired) > KEPT:
            _retired.popleft().close()
