"""A chip's registers as a table, which says what the data sheet says; its file is TOML.

From it come a new chip's driver, its page, and its double, which goes by the table at run time. The
contract of chips compares the driver with it, register by register.
"""

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from firmware_runtime.board.settings import Address, Settings

Word: TypeAlias = Annotated[int, Meta(ge=0, le=0xFFFF)]


class Register(Settings, frozen=True, kw_only=True):
    """One register, as `[[registers]]` in the file."""

    name: str
    """As the data sheet prints it."""
    address: Annotated[int, Meta(ge=0, le=0xFF)]
    access: Literal["r", "w", "rw"]
    reset: Word
    """Its content after power-up."""
    source: str
    """Where the data sheet says so: page, table or section."""
    about: str | None = None
    width: Literal[8, 16] = 8
    byte_order: Literal["big", "little"] | None = None
    """Which byte of 16 bits comes first; big unless stated."""
    writable: Word | None = None
    """The bits that keep what is written; all unless stated."""
    identity: bool = False
    """Whether it always reads as at power-up, so that it identifies the chip."""
    bring_up: Word | None = None
    """What the driver writes into it when it brings the chip up."""
    clear_on_read: Word = 0
    """The bits that reading clears."""
    self_clearing: Word = 0
    """The bits that clear by themselves, `busy_us` after they were written."""
    busy_us: Annotated[float, Meta(ge=0, le=1e9)] = 0.0
    """How long the chip is busy with what those bits began."""
    quantity: str | None = None
    """What it measures, with its unit: `light_lx`; the driver has a method to read it."""
    unit: str | None = None
    scale: float | None = None
    """How many units one count stands for; 1 unless stated."""
    offset: float | None = None
    """How many units the count 0 stands for; 0 unless stated."""
    signed: bool | None = None
    """Whether the count is in two's complement; not unless stated."""
    lowest_bit: Annotated[int, Meta(ge=0, le=15)] = 0
    """Where the count begins; what is below it is flags, or nothing."""

    @property
    def bytes(self) -> int:
        """Number of its bytes."""
        return self.width // 8

    @property
    def order(self) -> Literal["big", "little"]:
        """Byte order: which byte comes first."""
        return self.byte_order or "big"

    @property
    def all_bits(self) -> int:
        """A one for each of its bits."""
        return (1 << self.width) - 1

    @property
    def kept_bits(self) -> int:
        """The bits that keep what is written into them."""
        writable = self.all_bits if self.writable is None else self.writable
        return writable & ~self.self_clearing if "w" in self.access else 0

    @property
    def busy_ns(self) -> int:
        """Time for which the chip is busy, in whole nanoseconds."""
        return round(self.busy_us * 1000)

    @property
    def counts(self) -> range:
        """The counts it can hold."""
        half = 1 << self.width - self.lowest_bit - 1
        return range(-half, half) if self.signed else range(2 * half)

    def value(self, count: int) -> float:
        """Return what a count stands for, in its unit."""
        return count * (1.0 if self.scale is None else self.scale) + (self.offset or 0.0)

    def count(self, word: int) -> int:
        """The count that a word is."""
        is_negative = self.signed and word >> self.width - 1
        return (word - (1 << self.width) if is_negative else word) >> self.lowest_bit

    def word(self, value: float) -> int:
        """The word that stands for a value, without flags; beyond its scale's ends, the last."""
        count = round((value - (self.offset or 0.0)) / (1.0 if self.scale is None else self.scale))
        within = max(self.counts[0], min(self.counts[-1], count))
        return within << self.lowest_bit & self.all_bits


class RegisterTable(Settings, frozen=True, kw_only=True):
    """A whole chip."""

    chip: str
    """As the data sheet prints it."""
    title: str
    """What it is, in a few words."""
    source: str
    """The data sheet and its revision."""
    addresses: Annotated[tuple[Address, ...], Meta(min_length=1)]
    """Where it can be on the bus, 7 bits; a new one is at the first."""
    auto_increment: bool
    """Whether the pointer goes on after each byte; then 16 bits take two addresses."""
    reserved: Literal["refused"] | Annotated[int, Meta(ge=0, le=0xFF)]
    """What an address without a register reads, or whether it is not acknowledged."""
    registers: tuple[Register, ...]

    @property
    def readable(self) -> tuple[Register, ...]:
        """The registers that can be read."""
        return tuple(each for each in self.registers if "r" in each.access)

    @property
    def identities(self) -> tuple[Register, ...]:
        """The registers that identify the chip."""
        return tuple(each for each in self.registers if each.identity)

    @property
    def brought_up(self) -> tuple[Register, ...]:
        """The registers that the driver writes when it brings the chip up."""
        return tuple(each for each in self.registers if each.bring_up is not None)

    @property
    def quantities(self) -> tuple[Register, ...]:
        """The registers that measure something."""
        return tuple(each for each in self.registers if each.quantity is not None)

    def span(self, register: Register) -> range:
        """The addresses that a register takes."""
        taken = register.bytes if self.auto_increment else 1
        return range(register.address, register.address + taken)

    @property
    def free(self) -> list[int]:
        """The addresses without a register."""
        taken = {address for each in self.registers for address in self.span(each)}
        return [address for address in range(256) if address not in taken]
