"""CHIP_PRINTED, CHIP_TITLE (CHIP_SOURCE).

Responsible for: identity, bring-up, checking that the chip still is as brought up, counts to units.
Not for: what the register table does not say.
"""

from types import MappingProxyType
from typing import Final

from firmware_drivers.chips.register_chip import ChipRegister, Expected, RegisterChip, Setting

ADDRESSES: Final = CHIP_ADDRESSES
"""A new chip is at the first."""

REGISTER_CONSTANTS

REGISTERS: Final = MappingProxyType({each.name: each for each in REGISTER_NAMES})
IDENTITY: Final[tuple[Expected, ...]] = IDENTITY_ROWS
"""Registers that identify the chip; None where any answer will do."""
BRING_UP: Final[tuple[Setting, ...]] = SETTING_ROWS
"""Values written at bring-up, the bits that stay so, and the wait after it in ns."""


class ChipName(RegisterChip):
    """One chip: take the steps of `bring_up`, then read it."""

    chip = "CHIP_PRINTED"
    addresses = ADDRESSES
    registers = REGISTERS
    identity = IDENTITY
    settings = BRING_UPQUANTITY_METHODS
