"""Base of `busio.I2C` for CircuitPython drivers, over anything that carries out transactions.

Source: CircuitPython 9, shared-bindings/busio/I2C.c.
"""

from abc import abstractmethod
from array import array
from typing import TypeAlias

from firmware_runtime.hal.circuitpython.released import Released
from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.scan import ADDRESSES

Readable: TypeAlias = "bytes | bytearray | memoryview | array[int]"
Writable: TypeAlias = "bytearray | memoryview | array[int]"


class CircuitPythonI2c(Released):
    """A bus as `busio.I2C`, to be locked before it is used, as on a microcontroller."""

    def __init__(self) -> None:
        self._locked = self._closed = False

    @abstractmethod
    def _transaction(self, address: int, messages: tuple[Message, ...]) -> bytes:
        """Carry out one transaction, as `I2cBus.transaction`. Raises OSError with an errno."""

    def try_lock(self) -> bool:
        """Take the bus; False where it is taken already."""
        if self._locked:
            return False
        self._locked = True
        return True

    def unlock(self) -> None:
        """Give the bus back. Raises ValueError where it is not taken."""
        if not self._locked:
            raise ValueError("Not locked")
        self._locked = False

    def deinit(self) -> None:
        """Close the bus; using it afterwards raises ValueError."""
        self._closed = True

    def scan(self) -> list[int]:
        """Return the addresses from 0x08 to 0x77 that acknowledge."""
        return [address for address in ADDRESSES if self._acknowledges(address)]

    def writeto(
        self, address: int, buffer: Readable, *, start: int = 0, end: int | None = None
    ) -> None:
        """Write `buffer[start:end]`; no bytes at all ask whether the chip is there."""
        self._transfer(address, (_part(buffer, start, end).tobytes(),))

    def readfrom_into(
        self, address: int, buffer: Writable, *, start: int = 0, end: int | None = None
    ) -> None:
        """Fill `buffer[start:end]` from the chip."""
        part = _part(buffer, start, end)
        part[:] = self._transfer(address, (len(part),))

    def writeto_then_readfrom(  # noqa: PLR0913 -- CircuitPython's signature
        self,
        address: int,
        out_buffer: Readable,
        in_buffer: Writable,
        *,
        out_start: int = 0,
        out_end: int | None = None,
        in_start: int = 0,
        in_end: int | None = None,
    ) -> None:
        """Write, repeated START, read: one transaction."""
        written, part = _part(out_buffer, out_start, out_end), _part(in_buffer, in_start, in_end)
        part[:] = self._transfer(address, (written.tobytes(), len(part)))

    def _acknowledges(self, address: int) -> bool:
        try:
            self._transfer(address, (b"",))
        except OSError:
            return False
        return True

    def _transfer(self, address: int, messages: tuple[Message, ...]) -> bytes:
        if self._closed:
            raise ValueError("Object has been deinitialized and can no longer be used.")
        if not self._locked:
            raise RuntimeError("Function requires lock")
        return self._transaction(address, messages)


def _part(buffer: Readable, start: int, end: int | None) -> memoryview:
    return memoryview(buffer).cast("B")[start:end]
