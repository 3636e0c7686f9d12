r"""The I2C bus a driver speaks: one required method, everything else derived from it.

A transaction is everything between START and STOP. It is given as a list of messages: bytes are
written, a number is that many bytes to read. Between messages the bus issues a repeated START with
the same address; only after the last one it issues STOP. So

    bus.transaction(0x68, [b"\x3b", 14])

puts START, address+W, 0x3B, repeated START, address+R, 14 bytes (the last not acknowledged), STOP
on the wire. Addresses are 7-bit, right-aligned. Nothing is sent in parts: a transaction either
happened whole, or a `HalError` says where it ended.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from time import sleep
from typing import NoReturn, SupportsIndex, TypeAlias

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.wire_errors import NoAcknowledge

Message: TypeAlias = bytes | int
"""Bytes to write, or a number of bytes to read (1 or more)."""

GENERAL_CALL = 0x00


class I2cBus(ABC):
    """A bus by its name, as in board.toml and in every error.

    One that `returns_early` answers before the transaction has ended on the wire, as doubles in
    another process do: for them it goes on as long as it takes.
    """

    name: str
    returns_early: bool = False

    def __reduce_ex__(self, _protocol: SupportsIndex) -> NoReturn:
        """Refuse to be copied: a bus is no state of the model that speaks to it."""
        raise TypeError(f"{self.name}: a bus cannot be copied or kept")

    @abstractmethod
    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry out one transaction; return what was read, in order, joined.

        Raises NoAcknowledge, ArbitrationLost, BusTimeout, BusFault, AddressInUse or PortClosed.
        """

    def write(self, address: int, data: bytes) -> None:
        """START, address+W, data, STOP."""
        self.transaction(address, (data,))

    def read(self, address: int, length: int) -> bytes:
        """START, address+R, `length` bytes, STOP."""
        return self.transaction(address, (length,))

    def write_read(self, address: int, data: bytes, length: int) -> bytes:
        """START, address+W, data, repeated START, address+R, `length` bytes, STOP."""
        return self.transaction(address, (data, length))

    def acknowledges(self, address: int) -> bool:
        """START, address+R, one byte if something answers, STOP: for chips that are silent at work.

        Asked once, never again at a refusal. Raises what a transaction raises but NoAcknowledge.
        """
        try:
            self.read(address, 1)
        except NoAcknowledge:
            return False
        return True

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to the end of the last transaction.

        0 on a bus that belongs to no run.
        """
        return 0

    def pause(self, span: int) -> None:
        """Let `span` ns pass before the next transaction, in the time that the bus lives in."""
        sleep(span / SECOND)

    def close(self) -> None:  # noqa: B027 -- a bus that holds nothing has nothing to release
        """Release the bus; using it afterwards raises PortClosed."""
