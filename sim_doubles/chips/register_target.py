"""A target with a register pointer, as most small chips have: what they share on the wire.

The first byte written sets the pointer, the following ones are register contents; every byte read
or written moves the pointer on. It is kept from one transaction to the next.
"""

from abc import abstractmethod

from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target


class RegisterTarget(Target):
    """A chip at `address`; a chip says what its registers do.

    `_at` is the instant of START; register contents arrive later, when their message has ended, and
    then `_at` is that instant.
    """

    def __init__(self, now: Now, address: int) -> None:
        self.address = address
        self._now = now
        self._at = now()
        self._pointer = 0
        self._in_transaction = self._expects_pointer = False

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the addresses the chip listens to."""
        if not self._listens_to(address, read=read):
            return False
        if not self._in_transaction:
            self._at = self._now()
            self._in_transaction = True
            self._begin()
        self._expects_pointer = not read
        return True

    def write(self, byte: int) -> bool:
        """Take the pointer, then register contents."""
        if self._expects_pointer:
            self._expects_pointer = False
            self._pointer = byte
        else:
            self._go_on()
            self._write_register(self._pointer, byte)
            self._pointer = self._after(self._pointer)
        return True

    def read(self) -> int:
        """Give the register at the pointer."""
        register = self._pointer
        self._pointer = self._after(register)
        return self._read_register(register)

    def stop(self) -> None:
        """End the transaction, if it was this chip's."""
        if self._in_transaction:
            self._in_transaction = False
            self._end()

    def power_cycle(self) -> None:
        """Lose supply and get it back: the transaction is over, the pointer is 0."""
        self._at = self._now()
        self._pointer = 0
        self._in_transaction = self._expects_pointer = False

    def _go_on(self) -> None:
        """Be where the clock is now; a message takes time on the wire."""
        now = self._now()
        if now != self._at:
            self._at = now
            self._begin()

    # What a chip says

    def _listens_to(self, address: int, *, read: bool) -> bool:  # noqa: ARG002 (for general calls)
        return address == self.address

    def _begin(self) -> None:
        """Bring the chip to the instant `_at`: of a START, or of the end of a message."""

    def _end(self) -> None:
        """Do what waits for STOP."""

    def _after(self, register: int) -> int:
        """Return where the pointer goes from a register."""
        return register + 1 & 0xFF

    @abstractmethod
    def _read_register(self, register: int) -> int:
        """Return a register's content, with the side effects reading it has."""

    @abstractmethod
    def _write_register(self, register: int, byte: int) -> None:
        """Take a byte for a register."""
