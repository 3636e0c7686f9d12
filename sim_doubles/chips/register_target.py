"""A target with a register pointer, as most small chips have: what they share on the wire.

The first byte written sets the pointer, the following ones are register contents; after each
register that was read or written the pointer moves on. It is kept from one transaction to the next.

A register is a byte unless a chip says otherwise. A word is taken when its last byte has arrived,
and a word that is read is the one of the instant of its first byte, so it is never torn.
"""

from abc import abstractmethod
from typing import Literal, TypeAlias

from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target

ByteOrder: TypeAlias = Literal["big", "little"]


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
        self._taken = bytearray()  # of the word that is being written
        self._given = b""  # what is left of the word that is being read

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the addresses the chip listens to; what is left of a word is dropped."""
        self._drop()
        if not self._listens_to(address, read=read):
            return False
        if not self._in_transaction:
            self._at = self._now()
            self._in_transaction = True
            self._begin()
        self._expects_pointer = not read
        return True

    def write(self, byte: int) -> bool:
        """Take the pointer, then registers byte by byte."""
        if self._expects_pointer:
            self._expects_pointer = False
            return self._point(byte)
        register = self._pointer
        if not self._writes_to(register):
            return False
        self._taken.append(byte)
        if len(self._taken) == self._width(register):
            word = int.from_bytes(self._taken, self._order(register))
            self._taken.clear()
            self._go_on()
            self._write_register(register, word)
            self._pointer = self._after(register)
        return True

    def read(self) -> int:
        """Give the next byte of the register at the pointer."""
        if not self._given:
            register = self._pointer
            self._pointer = self._after(register)
            word = self._read_register(register)
            self._given = word.to_bytes(self._width(register), self._order(register))
        byte, self._given = self._given[0], self._given[1:]
        return byte

    def stop(self) -> None:
        """End the transaction, if it was this chip's; what is left of a word is dropped."""
        self._drop()
        if self._in_transaction:
            self._in_transaction = False
            self._end()

    def power_cycle(self) -> None:
        """Lose supply and get it back: the transaction is over, the pointer 0, the chip reset."""
        self._at = self._now()
        self._pointer = 0
        self._in_transaction = self._expects_pointer = False
        self._taken.clear()
        self._given = b""
        self._reset()

    def _go_on(self) -> None:
        """Be where the clock is now; a message takes time on the wire."""
        now = self._now()
        if now != self._at:
            self._at = now
            self._begin()

    def _drop(self) -> None:
        if self._taken:
            self._taken.clear()
            self._cut_short(self._pointer)
        self._given = b""

    # What a chip says

    def _reset(self) -> None:
        """Put everything volatile at its power-up value, at the instant `_at`."""

    def _listens_to(self, address: int, *, read: bool) -> bool:  # noqa: ARG002 (for general calls)
        return address == self.address

    def _begin(self) -> None:
        """Bring the chip to the instant `_at`: of a START, or of the end of a message."""

    def _end(self) -> None:
        """Do what waits for STOP."""

    def _point(self, byte: int) -> bool:
        """Take the pointer; False refuses it."""
        self._pointer = byte
        return True

    def _after(self, register: int) -> int:
        """Return where the pointer goes from a register."""
        return register + 1 & 0xFF

    def _width(self, register: int) -> int:  # noqa: ARG002 (all alike unless a chip says so)
        """Return how many bytes a register has."""
        return 1

    def _order(self, register: int) -> ByteOrder:  # noqa: ARG002 (likewise)
        """Return which byte of a register comes first."""
        return "big"

    def _writes_to(self, register: int) -> bool:  # noqa: ARG002 (likewise)
        """Return whether a byte for a register is acknowledged."""
        return True

    def _cut_short(self, register: int) -> None:
        """Note that a word for a register ended before its last byte; it keeps its content."""

    @abstractmethod
    def _read_register(self, register: int) -> int:
        """Return a register's content, with the side effects reading it has."""

    @abstractmethod
    def _write_register(self, register: int, byte: int) -> None:
        """Take the content of a register: a byte, or a word."""
