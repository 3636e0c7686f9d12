"""A target whose registers are words: 16 bits each, or some of 8, high byte or low byte first.

The first byte written sets the pointer. A word is taken when its last byte has arrived, and a word
that is read is the one of the instant of its first byte, so it is never torn. Where the pointer
goes after a word is the chip's to say: it stays unless a chip says otherwise, as it does in most
chips with 16-bit registers.
"""

from abc import abstractmethod
from typing import Literal, TypeAlias

from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now

ByteOrder: TypeAlias = Literal["big", "little"]


class WordRegisterTarget(RegisterTarget):
    """A chip at `address`; a chip says what its words do, and how wide and in what order they are.

    `_at` is the instant of START; a word arrives later, when its message has ended, and then `_at`
    is that instant.
    """

    def __init__(self, now: Now, address: int) -> None:
        super().__init__(now, address)
        self._taken = bytearray()  # of the word that is being written
        self._given = b""  # what is left of the word that is being read

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the addresses the chip listens to; what is left of a word is dropped."""
        self._drop()
        return super().start(address, read=read)

    def write(self, byte: int) -> bool:
        """Take the pointer, then words byte by byte."""
        if self._expects_pointer:
            self._expects_pointer = False
            return self._point(byte)
        return self._take(byte)

    def read(self) -> int:
        """Give the next byte of the word at the pointer."""
        if not self._given:
            register = self._pointer
            self._pointer = self._after(register)
            word = self._read_register(register)
            self._given = word.to_bytes(self._width(register), self._order(register))
        byte, self._given = self._given[0], self._given[1:]
        return byte

    def stop(self) -> None:
        """End the transaction; what is left of a word is dropped."""
        self._drop()
        super().stop()

    def power_cycle(self) -> None:
        """Lose supply and get it back: the transaction is over, the pointer is 0."""
        super().power_cycle()
        self._taken.clear()
        self._given = b""

    def _take(self, byte: int) -> bool:
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

    def _drop(self) -> None:
        if self._taken:
            self._taken.clear()
            self._cut_short(self._pointer)
        self._given = b""

    # What a chip says

    def _point(self, byte: int) -> bool:
        """Take the pointer; False refuses it."""
        self._pointer = byte
        return True

    def _after(self, register: int) -> int:
        """Return where the pointer goes after a word of a register."""
        return register

    def _width(self, register: int) -> int:  # noqa: ARG002 (all alike unless a chip says so)
        """Return how many bytes a register has."""
        return 2

    def _order(self, register: int) -> ByteOrder:  # noqa: ARG002 (likewise)
        """Return which byte of a register comes first."""
        return "big"

    def _writes_to(self, register: int) -> bool:  # noqa: ARG002 (likewise)
        """Whether a byte for a register is acknowledged."""
        return True

    def _cut_short(self, register: int) -> None:
        """Note that a word for a register ended before its last byte; it keeps its content."""

    @abstractmethod
    def _read_register(self, register: int) -> int:
        """Return a register's word, with the side effects reading it has."""

    @abstractmethod
    def _write_register(self, register: int, byte: int) -> None:
        """Take a word for a register."""
