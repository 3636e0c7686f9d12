"""Scan of an I2C bus: addresses that answer, probed as i2cdetect does, which changes nothing.

An address is probed by a write of no bytes: START, address, STOP. Where EEPROMs live and this could
set their write protection (0x30 to 0x37, 0x50 to 0x5F) one byte is read instead, as it is where an
adapter cannot write nothing (designware, of a Raspberry Pi 5). Reserved addresses are left out.
An address answers if it acknowledges twice: one acknowledge may belong to a transfer that was given
up, since QEMU's controllers send a START to the chip that is still addressed, whatever its address.
Sources: i2c-tools 4.3, tools/i2cdetect.c; QEMU 10, hw/i2c/core.c.
"""

from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Final, NamedTuple

from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import AddressInUse, BusFault, BusTimeout, NoAcknowledge

ADDRESSES: Final = range(0x08, 0x78)
READ_ONLY: Final = frozenset((*range(0x30, 0x38), *range(0x50, 0x60)))
"""Addresses that are never written to."""


class State(Enum):
    """Finding at an address that is not free."""

    ANSWERS = "answers"
    HELD = "held"
    """A driver of the kernel's holds it; it was not probed."""
    FAULTY = "faulty"
    """The adapter reported a fault there, or one of two probes was not acknowledged."""


class Answer(NamedTuple):
    """One address, and for a fault its sentence."""

    address: int
    state: State
    sentence: str = ""


def scan(bus: I2cBus, addresses: Iterable[int] = ADDRESSES) -> Iterator[Answer]:
    """Give every address where something is.

    Raises BusTimeout where a line is held: no other address would fare better; and PortClosed.
    """
    for address in addresses:
        has_acknowledged = False
        try:
            _ask(bus, address)
            has_acknowledged = True
            _ask(bus, address)
        except NoAcknowledge as error:
            if has_acknowledged:
                yield Answer(address, State.FAULTY, f"acknowledged once, then: {error}")
        except AddressInUse as error:
            yield Answer(address, State.HELD, str(error))
        except BusFault as error:
            yield Answer(address, State.FAULTY, str(error))
        else:
            yield Answer(address, State.ANSWERS)


def _ask(bus: I2cBus, address: int) -> None:
    """Ask once more after a timeout: an interrupt may come late; a held line makes a second one."""
    try:
        _ask_once(bus, address)
    except BusTimeout:
        _ask_once(bus, address)


def _ask_once(bus: I2cBus, address: int) -> None:
    if address not in READ_ONLY:
        try:
            bus.write(address, b"")
        except BusFault:
            pass  # this adapter cannot write nothing
        else:
            return
    bus.read(address, 1)
