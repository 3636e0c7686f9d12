"""Base of drivers that `firmware-runtime new chip` writes: read, write, check registers.

A driver states its registers, which of them identify the chip, and what is written into
which when it is brought up; it adds what they mean in units.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import ClassVar, Literal, NamedTuple

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge


class ChipRegister(NamedTuple):
    """A register: its name in the data sheet, its address, and how its bytes are laid out."""

    name: str
    address: int
    bytes: int = 1
    order: Literal["big", "little"] = "big"
    signed: bool = False


class Expected(NamedTuple):
    """Value of an identity register; None where any answer will do."""

    register: ChipRegister
    word: int | None


class Setting(NamedTuple):
    """Value written at bring-up, the bits of it that stay so, and the wait after it, in ns."""

    register: ChipRegister
    word: int
    kept_bits: int
    wait_ns: int


class RegisterChip(I2cChip):
    """One chip on a bus, brought up from any state by `bring_up`."""

    registers: ClassVar[Mapping[str, ChipRegister]]
    """By their names."""
    identity: ClassVar[Sequence[Expected]]
    settings: ClassVar[Sequence[Setting]]

    def __init__(self, bus: I2cBus, address: int | None = None) -> None:
        super().__init__(bus, self.addresses[0] if address is None else address)

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready; they raise NoAcknowledge or WrongDevice."""
        writes = (
            Step(f"write {each.register.name}", partial(self.write, *each[:2]), each.wait_ns)
            for each in self.settings
        )
        return (Step("identify", self.identify, 0), *writes)

    def identify(self) -> None:
        """Check that it answers and is this chip. Raises NoAcknowledge or WrongDevice."""
        self.evidence()

    def evidence(self) -> str:
        """Check as `identify` does; return what was read, for people."""
        found = [(register, self.read(register), word) for register, word in self.identity]
        for register, word, expected in found:
            if expected is not None and word != expected:
                raise self._wrong_device(
                    f"{register.name} reads {_hex(register, word)}", _hex(register, expected)
                )
        return ", ".join(
            f"{register.name} reads {_hex(register, word)}" for register, word, _ in found
        )

    def verify(self) -> None:
        """Check that it still is as brought up. Raises NotReady if not."""
        for register, word, kept_bits, _ in self.settings:
            found = self.read(register)
            if (found ^ word) & kept_bits:
                raise self._not_ready(
                    f"{register.name} reads {_hex(register, found)}, expected "
                    f"{_hex(register, word)}; it was reset or another program wrote to "
                    "it"
                )

    def read(self, register: ChipRegister) -> int:
        """Read a register's word, one transaction. Raises NoAcknowledge if the chip is absent."""
        try:
            found = self._read(register.address, register.bytes)
        except NoAcknowledge as error:
            raise self._no_answer(register.name) from error
        return int.from_bytes(found, register.order, signed=register.signed)

    def write(self, register: ChipRegister, word: int) -> None:
        """Write a register's word, one transaction. Raises NoAcknowledge if the chip is absent."""
        data = word.to_bytes(register.bytes, register.order, signed=word < 0)
        try:
            self._write(register.address, *data)
        except NoAcknowledge as error:
            raise self._no_answer(register.name) from error

    def read_by_name(self, name: str) -> int:
        """Read a register by its name, as the contract of chips and consoles have it."""
        return self.read(self.registers[name])

    def write_by_name(self, name: str, word: int) -> None:
        """Write a register by its name."""
        self.write(self.registers[name], word)


def _hex(register: ChipRegister, word: int) -> str:
    return f"{word & (1 << 8 * register.bytes) - 1:0{2 * register.bytes}x}"
