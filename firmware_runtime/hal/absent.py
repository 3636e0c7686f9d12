"""Lines that are not there: nothing is to be opened, or they could not be."""

from collections.abc import Sequence

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusAbsent


class AbsentBus(I2cBus):
    """Refuses every transaction with BusAbsent, which says `why`."""

    def __init__(self, name: str, why: str = "this bus was not opened") -> None:
        self.name = name
        self._why = why

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:  # noqa: ARG002
        """Refuse."""
        raise BusAbsent(f"{self.name} 0x{address:02x}: {self._why}")


class AbsentPort(SerialPort):
    """Refuses every write and read with BusAbsent, which says `why`."""

    def __init__(self, name: str, why: str = "this port was not opened") -> None:
        self.name = name
        self._why = why

    def write(self, data: bytes) -> None:
        """Refuse."""
        raise BusAbsent(f"{len(data)} bytes not written: {self._why}", where=self.name)

    def read_available(self) -> bytes:
        """Refuse."""
        raise BusAbsent(self._why, where=self.name)

    def close(self) -> None:
        """There is nothing to release."""
