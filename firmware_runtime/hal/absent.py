"""Lines that are not there: for looking at a robot's model where nothing is to be opened."""

from collections.abc import Sequence

from firmware_runtime.hal.errors import BusAbsent
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort


class AbsentBus(I2cBus):
    """Refuses every transaction with BusAbsent."""

    def __init__(self, name: str) -> None:
        self.name = name

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:  # noqa: ARG002
        """Refuse."""
        raise BusAbsent(f"{self.name} 0x{address:02x}: this bus was not opened")


class AbsentPort(SerialPort):
    """Refuses every write and read with BusAbsent."""

    def __init__(self, name: str) -> None:
        self.name = name

    def write(self, data: bytes) -> None:
        """Refuse."""
        raise BusAbsent(f"{self.name}: {len(data)} bytes for a port that was not opened")

    def read_available(self) -> bytes:
        """Refuse."""
        raise BusAbsent(f"{self.name}: this port was not opened")

    def close(self) -> None:
        """There is nothing to release."""
