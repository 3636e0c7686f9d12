"""Base of drivers of chips on I2C: their name in errors, registers, an answer that is due."""

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import ClassVar

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice


class I2cChip:
    """One chip on a bus. Raises SettingError for `faults`, and an address that it cannot have."""

    chip: ClassVar[str]
    """As its data sheet calls it."""
    addresses: ClassVar[Sequence[int]]

    def __init__(self, bus: I2cBus, address: int, faults: Sequence[str] = ()) -> None:
        self.address = address
        self.place = f"{self.chip} at 0x{address:02x} on {bus.name}"
        self.line = self._bus = bus
        if address not in self.addresses:
            faults = (f"address: 0x{address:02x}, expected {_in_words(self.addresses)}", *faults)
        if faults:
            raise SettingError("; ".join(faults), where=self.place)

    @contextmanager
    def _must_answer(self, expected: str, what: str = "no answer") -> Iterator[None]:
        """Say what was expected of a chip that does not acknowledge within the block.

        For bring-up: what recurs has no block around each transaction (`_no_answer`).
        """
        try:
            yield
        except NoAcknowledge as error:
            raise self._no_answer(expected, what) from error

    def _no_answer(self, expected: str, what: str = "no answer") -> NoAcknowledge:
        return NoAcknowledge(what, where=self.place, expected=expected)

    def _not_ready(self, what: str, expected: str = "") -> NotReady:
        return NotReady(what, where=self.place, expected=expected)

    def _was_changed(self, what: str, expected: str) -> NotReady:
        why = "it was reset or written to by another program"
        return self._not_ready(f"{what}, expected {expected}; {why}")

    def _wrong_device(self, what: str, expected: str = "") -> WrongDevice:
        return WrongDevice(what, where=self.place, expected=expected)

    def _read(self, register: int, length: int = 1) -> bytes:
        return self._bus.write_read(self.address, bytes((register,)), length)

    def _write(self, register: int, *values: int) -> None:
        self._bus.write(self.address, bytes((register, *values)))


def choice_fault(key: str, value: object, choices: Iterable[object]) -> list[str]:
    """List the fault of a setting that is none of the choices, in a sentence."""
    known = list(choices)
    if value in known:
        return []
    return [f"{key}: {value}, expected one of {', '.join(map(str, known))}"]


def _in_words(addresses: Sequence[int]) -> str:
    first, last = addresses[0], addresses[-1]
    if list(addresses) == list(range(first, last + 1)) and len(addresses) > 2:
        return f"0x{first:02x} to 0x{last:02x}"
    return ", ".join(f"0x{each:02x}" for each in addresses)
