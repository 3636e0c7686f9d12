"""Winch, winch motor with brake and encoder (example, rev. 1).

Responsible for: identity, bring-up, checking that the chip still is as brought up, counts to units.
Not for: what the register table does not say.
"""

from types import MappingProxyType
from typing import Final

from firmware_drivers.chips.register_chip import ChipRegister, Expected, RegisterChip, Setting

ADDRESSES: Final = (0x1E, 0x1F)
"""A new chip is at the first."""

ID: Final = ChipRegister("ID", 0x00)
"""identity; p. 3"""
CONTROL: Final = ChipRegister("CONTROL", 0x01)
"""1 lifts the brake and lets POWER through; 0: motor off, brake on; p. 4"""
LIMIT: Final = ChipRegister("LIMIT", 0x02)
"""limit of the motor's current, 20 mA a count; p. 4"""
POWER: Final = ChipRegister("POWER", 0x03)
"""share of full voltage, two's complement, 127 is full voltage forward; p. 5"""
PLACE: Final = ChipRegister("PLACE", 0x04, 2, "little", signed=True)
"""where the cable is; p. 6"""

REGISTERS: Final = MappingProxyType(
    {
        each.name: each
        for each in (
            ID,
            CONTROL,
            LIMIT,
            POWER,
            PLACE,
        )
    }
)
IDENTITY: Final[tuple[Expected, ...]] = (Expected(ID, 0x57),)
"""Registers that identify the chip; None where any answer will do."""
BRING_UP: Final[tuple[Setting, ...]] = (Setting(LIMIT, 0x60, 0xFF, 0),)
"""Values written at bring-up, the bits that stay so, and the wait after it in ns."""


class Winch(RegisterChip):
    """One chip: take the steps of `bring_up`, then read it."""

    chip = "Winch"
    addresses = ADDRESSES
    registers = REGISTERS
    identity = IDENTITY
    settings = BRING_UP

    def read_place_m(self) -> float:
        """Read PLACE, in m: one transaction.

        Raises NoAcknowledge if the chip is absent.
        """
        return self.read(PLACE) * 0.0005
