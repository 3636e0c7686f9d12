"""What the doubles of Devantech's I2C modules share: commands, and an address that they change.

Commands are written to a command register. Some are sequences of several bytes, each a write of its
own; on every module one of these changes the address: A0, AA, A5 and the new 8-bit one.

Source: Devantech's SRF08, CMPS12, CMPS14 and MD25 pages. Assumed where they are silent: a byte that
has no place in the sequence breaks it off and is taken as the command it is by itself; a new
address counts at once.
"""

from collections.abc import Callable, Sequence

from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now

CHANGE_ADDRESS = (0xA0, 0xAA, 0xA5, None)


class DevantechDouble(RegisterTarget):
    """A module at one of the `addresses` it can have; a power cycle keeps the address."""

    def __init__(self, now: Now, chip: str, address: int, addresses: range) -> None:
        super().__init__(now, checked_address(chip, address, addresses))
        self.warnings = ProtocolWarnings(f"{chip} 0x{address:02x}")
        self._addresses = addresses
        self._sequences = [CommandSequence(CHANGE_ADDRESS, self._readdress, self.warnings)]

    def _reset(self) -> None:
        for sequence in self._sequences:
            sequence.reset()

    def _break_off(self) -> None:
        """Note that a write elsewhere ends the sequence under way."""
        for sequence in self._sequences:
            sequence.break_off()

    def _take_command(self, byte: int) -> None:
        taken = [sequence.take(byte) for sequence in self._sequences]
        if not any(taken) and not self._obey(byte):
            self.warnings.note(f"command 0x{byte:02x} does not exist; it is ignored")

    def _obey(self, command: int) -> bool:  # noqa: ARG002 (none of one byte unless a chip says so)
        """Carry out a command of one byte; False if there is no such command."""
        return False

    def _readdress(self, byte: int) -> None:
        """Take an 8-bit address; one that the module cannot have is ignored."""
        valid = self._addresses
        if byte & 1 or byte >> 1 not in valid:
            self.warnings.note(
                f"new address 0x{byte:02x} is not an even number from 0x{valid[0] << 1:02x} to "
                f"0x{valid[-1] << 1:02x}; it is ignored"
            )
        else:
            self.address = byte >> 1


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


def checked_address(chip: str, address: int, valid: range) -> int:
    """Return an address the chip can have. Raises ValueError if it cannot."""
    if address not in valid:
        raise ValueError(
            f"{chip}: address is 0x{address:02x}, expected 0x{valid[0]:02x} to 0x{valid[-1]:02x}"
        )
    return address
