"""An i2c-tiny-usb adapter as a USB device: answers the requests of Linux's driver of that name.

The driver sends an I2C transaction message by message, each with its address, and asks after each
whether it was acknowledged. Doubles take a transaction as a whole; so writes wait for the message
that ends it, or for a read, and count as acknowledged until then. A program sees no difference:
whichever message was refused, the kernel reports ENXIO for the whole call. What is sent on with a
read that is not last is a piece of the transaction, held without STOP.

A full-speed device with one interface of the vendor's own kind and no endpoint but 0.

Not modelled: the speed of the bus (SET_DELAY is taken and changes nothing), clock stretching.
Source: Linux 6.1 drivers/i2c/busses/i2c-tiny-usb.c; USB 2.0, 9.6.
"""

import errno
import struct
from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Final, NamedTuple, TypeAlias

from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import EREMOTEIO
from sim_doubles.usbip.packets import Setup, Stalled

FUNCTIONALITY: Final = 0x0EFF_0009
"""Plain transfers, and every SMBus call that can be made of them."""
VENDOR: Final = 0x0403
PRODUCT: Final = 0xC631
_DEVICE, _CONFIGURATION, _STRING = 0x0100, 0x0200, 0x0300
_OF_THE_VENDOR: Final = 0xFF
_ENGLISH: Final = 0x0409
_NAMES: Final = ("firmware-runtime", "doubles on I2C")


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
_REFUSALS: Final = {EREMOTEIO, errno.ENXIO}


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


def descriptors(serial: str) -> Mapping[int, bytes]:
    """Each descriptor by the value that GET_DESCRIPTOR asks for it with."""
    texts = {_STRING + index: _text(text) for index, text in enumerate((*_NAMES, serial), 1)}
    languages = struct.pack("<BBH", 4, 3, _ENGLISH)
    return {_DEVICE: _device(), _CONFIGURATION: _configuration(), _STRING: languages, **texts}


def _device() -> bytes:
    length, kind, usb, largest_packet, release = 18, 1, 0x0110, 64, 0x0100
    names = (1, 2, 3)
    configurations = 1
    return struct.pack(
        "<BBH4B3H4B",
        *(length, kind, usb, _OF_THE_VENDOR, 0, 0, largest_packet),
        *(VENDOR, PRODUCT, release, *names, configurations),
    )


def _configuration() -> bytes:
    """The only configuration, and in it the only interface."""
    interface = bytes((9, 4, 0, 0, 0, _OF_THE_VENDOR, 0, 0, 0))
    total, interfaces, number, name, bus_powered, milliampere = (
        9 + len(interface),
        1,
        1,
        0,
        0x80,
        100,
    )
    head = struct.pack(
        "<BBH5B", 9, 2, total, interfaces, number, name, bus_powered, milliampere // 2
    )
    return head + interface


def _text(text: str) -> bytes:
    encoded = text.encode("utf-16-le")
    return bytes((2 + len(encoded), 3)) + encoded
