"""Commands of several bytes as Devantech's modules take them: each byte a write of its own.

Source: Devantech's SRF08, CMPS12, CMPS14 and MD25 pages: A0, AA, A5 and the new 8-bit address.
Assumed where they are silent: a byte that has no place in the sequence breaks it off and is taken
as the command it is by itself; a new address counts at once.
"""

from collections.abc import Callable, Sequence

from sim_doubles.chips.protocol_warnings import ProtocolWarnings

CHANGE_ADDRESS = (0xA0, 0xAA, 0xA5, None)


class CommandSequence:
    """Command bytes that mean something in this order only; None stands for any byte.

    `action` is called with the last byte when it has come.
    """

    def __init__(
        self,
        codes: Sequence[int | None],
        action: Callable[[int], None],
        warnings: ProtocolWarnings,
    ) -> None:
        self._codes = tuple(codes)
        self._action = action
        self._warnings = warnings
        self._taken = 0

    def take(self, byte: int) -> bool:
        """Take one command byte; False if it has no place in the sequence."""
        if self._codes[self._taken] not in {byte, None}:
            self.break_off()
            if byte != self._codes[0]:
                return False
        self._taken += 1
        if self._taken == len(self._codes):
            self._taken = 0
            self._action(byte)
        return True

    def break_off(self) -> None:
        """Start over, with a warning if the sequence was under way."""
        if self._taken:
            self._warnings.note(f"command sequence broken off after {self._taken} bytes")
        self.reset()

    def reset(self) -> None:
        """Start over."""
        self._taken = 0


def changed_address(address: int, byte: int, valid: range, warnings: ProtocolWarnings) -> int:
    """Return the 7-bit address for an 8-bit one; the old one if that is not `valid`."""
    if byte & 1 or byte >> 1 not in valid:
        warnings.note(
            f"new address 0x{byte:02x} is not an even number from 0x{valid[0] << 1:02x} to "
            f"0x{valid[-1] << 1:02x}; it is ignored"
        )
        return address
    return byte >> 1


def checked_address(chip: str, address: int, valid: range) -> int:
    """Return a 7-bit address the chip can have. Raises ValueError if it cannot."""
    if address not in valid:
        raise ValueError(
            f"{chip}: address is 0x{address:02x}, expected 0x{valid[0]:02x} to 0x{valid[-1]:02x}"
        )
    return address
