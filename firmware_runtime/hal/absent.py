"""A bus that is not there: for looking at a robot's model where no bus is to be opened."""

from collections.abc import Sequence

from firmware_runtime.hal.errors import BusAbsent
from firmware_runtime.hal.i2c import I2cBus, Message


class AbsentBus(I2cBus):
    """Refuses every transaction with BusAbsent."""

    def __init__(self, name: str) -> None:
        self.name = name

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:  # noqa: ARG002
        """Refuse."""
        raise BusAbsent(f"{self.name} 0x{address:02x}: this bus was not opened")
