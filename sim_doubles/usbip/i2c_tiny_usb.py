"""An i2c-tiny-usb adapter as a USB device: answers the requests of Linux's driver of that name.

The driver sends an I2C transaction message by message, each with its address, and asks after each
whether it was acknowledged. Doubles take a transaction as a whole; so writes wait for the message
that ends it, or for a read, and count as acknowledged until then. A program sees no difference:
whichever message was refused, the kernel reports ENXIO for the whole call. What is sent on with a
read that is not last is a piece of the transaction, held without STOP.

Not modelled: the speed of the bus (SET_DELAY is taken and changes nothing), clock stretching.
Source: Linux 6.1 drivers/i2c/busses/i2c-tiny-usb.c.
"""

import errno
import struct
from collections.abc import Callable
from enum import IntEnum
from typing import Final, NamedTuple, TypeAlias

from firmware_runtime.hal.i2c import Message
from sim_doubles.usbip.descriptors import descriptors
from sim_doubles.usbip.errors import Stalled
from sim_doubles.usbip.packets import Setup

FUNCTIONALITY: Final = 0x0EFF_0009
"""Plain transfers, and every SMBus call that can be made of them."""


class Piece(NamedTuple):
    """A transaction, or a piece of one: messages with their addresses.

    It `continues` what was held, or begins with START; it `holds`, or ends with STOP.
    """

    messages: tuple[tuple[int, Message], ...]
    continues: bool
    holds: bool


Transfer: TypeAlias = Callable[[Piece], bytes]
"""Carries out a piece. Raises OSError with the errno of an adapter."""


class Kind(IntEnum):
    """Request types: direction, standard or vendor's, recipient."""

    FROM_DEVICE = 0x80
    TO_DEVICE = 0x00
    TO_INTERFACE = 0x01
    VENDOR_FROM_INTERFACE = 0xC1
    VENDOR_TO_INTERFACE = 0x41


class Standard(IntEnum):
    """Requests of every USB device that Linux makes of this one."""

    GET_STATUS = 0
    GET_DESCRIPTOR = 6
    SET_CONFIGURATION = 9
    SET_INTERFACE = 11


class Request(IntEnum):
    """Requests of the driver; bits beside TRANSFER say where in its transaction a message is."""

    ECHO = 0
    GET_FUNCTIONALITY = 1
    SET_DELAY = 2
    GET_STATUS = 3
    TRANSFER = 4


FIRST, LAST = 1, 2
READ: Final = 1
"""The bit of a message's flags that says it is read."""
ACKNOWLEDGED, REFUSED = 1, 2
_REFUSALS: Final = {errno.EREMOTEIO, errno.ENXIO}


class I2cTinyUsb:
    """One adapter, known to the kernel by its serial number, whose bus is `transfer`."""

    def __init__(self, serial: str, transfer: Transfer) -> None:
        self._transfer = transfer
        self._descriptors = descriptors(serial)
        self._status = ACKNOWLEDGED
        self._waiting: list[tuple[int, Message]] = []
        self._continues = False

    def control(self, setup: Setup, written: bytes) -> bytes:
        """Answer a control request. Raises Stalled for what the device does not know."""
        match setup.request_type, setup.request:
            case ((Kind.VENDOR_FROM_INTERFACE | Kind.VENDOR_TO_INTERFACE), request):
                return self._of_the_driver(request, setup, written)
            case Kind.FROM_DEVICE, Standard.GET_DESCRIPTOR if setup.value in self._descriptors:
                return self._descriptors[setup.value]
            case Kind.FROM_DEVICE, Standard.GET_STATUS:
                return bytes(2)
            case Kind.TO_DEVICE, Standard.SET_CONFIGURATION:
                return b""
            case Kind.TO_INTERFACE, Standard.SET_INTERFACE:
                return b""
        raise Stalled

    def _of_the_driver(self, request: int, setup: Setup, written: bytes) -> bytes:
        match request & ~(FIRST | LAST):
            case Request.TRANSFER:
                return self._message(request, setup, written)
        match request:
            case Request.ECHO:
                return struct.pack("<H", setup.value)
            case Request.GET_FUNCTIONALITY:
                return struct.pack("<I", FUNCTIONALITY)
            case Request.SET_DELAY:
                return b""
            case Request.GET_STATUS:
                return bytes((self._status,))
        raise Stalled

    def _message(self, request: int, setup: Setup, written: bytes) -> bytes:
        """Take one message; a read, and the last one, let happen what waits."""
        if request & FIRST:
            self._waiting.clear()
            self._continues = False
        is_read = bool(setup.value & READ)
        is_last = bool(request & LAST)
        self._status = ACKNOWLEDGED
        self._waiting.append((setup.index, setup.length if is_read else written))
        if is_read or is_last:
            return self._carried_out(setup.length if is_read else 0, holds=not is_last)
        return b""

    def _carried_out(self, read_length: int, *, holds: bool) -> bytes:
        """Carry out what waits; bytes that were not sent read as zeros, and the status says so."""
        piece = Piece(tuple(self._waiting), self._continues, holds)
        self._waiting.clear()
        self._continues = holds
        try:
            return self._transfer(piece)
        except OSError as error:
            self._continues = False
            if error.errno not in _REFUSALS:
                raise Stalled from error
            self._status = REFUSED
            return bytes(read_length)
