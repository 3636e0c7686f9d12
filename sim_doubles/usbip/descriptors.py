"""The USB descriptors of an i2c-tiny-usb adapter.

A full-speed device with one interface of the vendor's own kind and no endpoint but 0.
Source: USB 2.0, 9.6; the numbers that Linux's driver of that name looks for.
"""

import struct
from collections.abc import Mapping
from typing import Final

VENDOR: Final = 0x0403
PRODUCT: Final = 0xC631
_DEVICE, _CONFIGURATION, _STRING = 0x0100, 0x0200, 0x0300
_OF_THE_VENDOR: Final = 0xFF
_ENGLISH: Final = 0x0409
_NAMES: Final = ("firmware-runtime", "doubles on I2C")


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
