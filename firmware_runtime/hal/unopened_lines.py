"""Lines that are not open: opened on demand, absent, or noting what would be written.

A robot on doubles loads no adapter's library. What each function that opens a line does, and what
it raises, is said where it is defined: `linux`, `linux_serial`.
"""

from collections.abc import Sequence
from importlib import import_module

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusAbsent

_HERE = "firmware_runtime.hal"


def open_i2c(name: str, device: str, *, timeout_ms: int, alone: bool) -> I2cBus:
    """Open a bus by the path of its device node."""
    module = import_module(f"{_HERE}.linux")
    bus: I2cBus = module.open_i2c(name, device, timeout_ms=timeout_ms, alone=alone)
    return bus


def open_serial(name: str, device: str, baud: int, *, alone: bool) -> SerialPort:
    """Open a port by the path of its device node."""
    module = import_module(f"{_HERE}.linux_serial")
    port: SerialPort = module.open_serial(name, device, baud, alone=alone)
    return port


def check_node(name: str, device: str) -> None:
    """Raise BusAbsent unless this process may open the device node."""
    import_module(f"{_HERE}.linux").check_node(name, device)


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
