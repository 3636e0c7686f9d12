"""Lines that carry nothing out and note what would be written, and where."""

from collections.abc import Sequence

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort


class NotingBus(I2cBus):
    """Notes transactions that only write; whatever is read is zero."""

    def __init__(self, name: str, place: str, notes: list[str]) -> None:
        self.name = name
        self._place = place
        self._notes = notes

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Note what is written."""
        written = [message for message in messages if not isinstance(message, int)]
        if len(written) == len(messages):
            self._notes.append(f"{self._place} 0x{address:02x}: {b''.join(written).hex()}")
        return bytes(sum(message for message in messages if isinstance(message, int)))

    def pause(self, span: int) -> None:
        """Let no time pass: nothing is waited for."""


class NotingPort(SerialPort):
    """Notes what is written; nothing arrives."""

    def __init__(self, name: str, place: str, notes: list[str]) -> None:
        self.name = name
        self._place = place
        self._notes = notes

    def write(self, data: bytes) -> None:
        """Note it."""
        self._notes.append(f"{self._place}: {data.hex()}")

    def read_available(self) -> bytes:
        """Nothing."""
        return b""

    def close(self) -> None:
        """There is nothing to release."""
