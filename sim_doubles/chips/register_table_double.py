"""Double of a chip whose registers are a table: it does what the table says, and what it warns of.

Modelled: power-up values, access, reserved addresses, the pointer, bits that reading clears or that
clear by themselves after their time, and quantities, which a world gives in their units. What
follows from a register's content is the subclass's to say, in `written`.

Not modelled: what no table says, above all when a quantity is new. It is the world's of the instant
at which its first byte is read.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple, TypeAlias

from firmware_runtime.board.registers.register_table import Register, RegisterTable
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.chips.register_target import ByteOrder, RegisterTarget
from sim_doubles.clock import Now

World: TypeAlias = Callable[[int], Mapping[str, float]] | Mapping[str, float]
"""The quantities at an instant (ns), or at all times, by their names in the table."""
RELEASED = 0xFF


class _Place(NamedTuple):
    """Register at an address, or its second byte."""

    register: Register
    is_second: bool


class RegisterTableDouble(RegisterTarget):
    """A chip at `address`. World face: `word`, `put`, `warnings`, and the world's quantities."""

    def __init__(self, now: Now, table: RegisterTable, address: int, world: World) -> None:
        if address not in table.addresses:
            expected = ", ".join(f"0x{each:02x}" for each in table.addresses)
            raise ValueError(f"{table.chip}: address is 0x{address:02x}, expected {expected}")
        super().__init__(now, address)
        self.table = table
        self.warnings = ProtocolWarnings(f"{table.chip} 0x{address:02x}")
        self._world = world if callable(world) else partial(_always, world)
        self._places = {
            at: _Place(each, at != each.address)
            for each in table.registers
            for at in table.span(each)
        }
        self._reset()

    # World face

    def word(self, name: str) -> int:
        """Return a register's value now."""
        self._at = self._now()
        self._begin()
        return self._words[name]

    def put(self, name: str, word: int) -> None:
        """Let the chip itself put a word into a register."""
        self._words[name] = word

    def written(self, register: Register, word: int) -> None:
        """Do what follows from a word that the host wrote; nothing, unless a subclass says so."""

    # Bus face

    def _begin(self) -> None:
        for name, (bits, at) in list(self._clears_at.items()):
            if at <= self._at:
                self._words[name] &= ~bits
                del self._clears_at[name]

    def _point(self, byte: int) -> bool:
        if byte not in self._places and self.table.reserved == "refused":
            self.warnings.note(f"pointer written 0x{byte:02x}; there is no such register")
            return False
        self._pointer = byte
        return True

    def _after(self, register: int) -> int:
        if not self.table.auto_increment:
            return register
        return register + self._width(register) & 0xFF

    def _width(self, register: int) -> int:
        place = self._places.get(register)
        return 1 if place is None or place.is_second else place.register.bytes

    def _order(self, register: int) -> ByteOrder:
        place = self._places.get(register)
        return "big" if place is None else place.register.order

    def _writes_to(self, register: int) -> bool:
        return register in self._places or self.table.reserved != "refused"

    def _cut_short(self, register: int) -> None:
        name = self._places[register].register.name
        self.warnings.note(f"{name} written one byte; it has two, and keeps its content")

    def _read_register(self, register: int) -> int:
        place = self._places.get(register)
        if place is None or place.register.access == "w":
            self.warnings.note(f"register 0x{register:02x} read; nothing there can be read")
            return self._reserved(1 if place is None else self._width(register))
        word = self._read_word(place.register)
        return _second(place.register, word) if place.is_second else word

    def _write_register(self, register: int, byte: int) -> None:
        place = self._places.get(register)
        if place is None or place.register.access == "r":
            self.warnings.note(f"register 0x{register:02x} written; nothing there takes it")
            return
        word = byte
        if place.is_second:
            word = _with_second(place.register, self._words[place.register.name], byte)
        self._write_word(place.register, word)

    def _reserved(self, width: int) -> int:
        byte = RELEASED if self.table.reserved == "refused" else self.table.reserved
        return int.from_bytes(bytes((byte,)) * width, "big")

    def _read_word(self, register: Register) -> int:
        if register.quantity is not None:
            flags = self._words[register.name] & (1 << register.lowest_bit) - 1
            measured = register.word(self._world(self._at)[register.quantity])
            self._words[register.name] = measured | flags
        word = self._words[register.name]
        self._words[register.name] &= ~register.clear_on_read
        return word

    def _write_word(self, register: Register, word: int) -> None:
        kept = self._words[register.name] & ~(register.kept_bits | register.self_clearing)
        begun = word & register.self_clearing
        self._words[register.name] = kept | word & register.kept_bits | begun
        if begun:
            self._clears_at[register.name] = (register.self_clearing, self._at + register.busy_ns)
        self._begin()
        self.written(register, word)

    def _reset(self) -> None:
        self._words = {each.name: each.reset for each in self.table.registers}
        self._clears_at: dict[str, tuple[int, int]] = {}


def _always(world: Mapping[str, float], _at: int) -> Mapping[str, float]:
    return world


def _second(register: Register, word: int) -> int:
    return word & 0xFF if register.order == "big" else word >> 8


def _with_second(register: Register, word: int, byte: int) -> int:
    return word & 0xFF00 | byte if register.order == "big" else word & 0x00FF | byte << 8
