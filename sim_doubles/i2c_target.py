"""I2C targets and adapters: START, bytes, acknowledges, STOP, and the errno of what goes wrong.

Adapters: the same event has another errno on each of them. Where a firmware decides (refused byte
on i2c-tiny-usb) the errno of a refused address is taken.

Source: Linux 6.1 drivers/i2c/busses (bcm2835, designware, tiny-usb), algos/i2c-algo-bit, i2c-dev.
"""

import errno
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

from msgspec import Struct

from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import EREMOTEIO


class Words(NamedTuple):
    """So many measured words of 16 bits in a chip's registers, one after the other."""

    register: int
    length: int
    order: Literal["big", "little"] = "big"
    is_signed: bool = True
    overflow: tuple[int, int] | None = None
    """Register, and bit of it, that say that one of them is beyond its scale."""


class Target(ABC):
    """Anything that may pull SDA low. It decides by itself which addresses it answers to.

    The bus offers every START to every target, so all-call, sub-addresses and general call need
    nothing from the bus. `write` and `read` follow only a `start` that was acknowledged.
    """

    measured: Sequence[Words] = ()
    """Registers of what it measures, for faults of one axis: read by number, counting up."""

    source: int | None = None
    """Which of its inputs they are of now, of a chip with inputs that take turns in them."""

    is_connected: bool = True
    """False while a fault keeps it off every bus, that of another chip's own master included."""

    @abstractmethod
    def start(self, address: int, *, read: bool) -> bool:
        """Take a START or repeated START with its 7-bit address; True acknowledges it."""

    @abstractmethod
    def write(self, byte: int) -> bool:
        """Take one byte from the controller; False refuses it and ends the target's part."""

    @abstractmethod
    def read(self) -> int:
        """Put one byte on the bus; 0xFF leaves SDA released."""

    def write_bytes(self, message: bytes) -> int | None:
        """Take bytes up to one it refuses, whose index is returned; None if it took all.

        For a target that is alone in being addressed. One that can take many bytes at once in less
        time than one by one may, as long as nothing else differs.
        """
        for index, byte in enumerate(message):
            if not self.write(byte):
                return index
        return None

    def read_bytes(self, length: int) -> bytes:
        """Put so many bytes on the bus, likewise."""
        return bytes([self.read() for _ in range(length)])

    @abstractmethod
    def stop(self) -> None:
        """Take a STOP; it comes after every transaction, also one meant for another target."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose supply and get it back: everything volatile is at its power-up value."""


LONGEST_MESSAGE = 8192
MOST_MESSAGES = 42


class AdapterProfile(Struct, frozen=True):
    """The errno of each event, and which message lists the adapter refuses before any START.

    `functions` is what it answers to the ioctl I2C_FUNCS.
    """

    address_refused: int
    byte_refused: int
    no_completion: int
    functions: int
    read_must_be_last: bool = False
    empty_write: bool = True
    empty_read: bool = True

    def refusal(self, messages: Sequence[Message], last: int) -> int | None:
        """Return the errno these messages are refused with, None when the adapter takes them.

        `last` is the place of the transaction's last message: none of these if others follow.
        """
        if not 1 <= len(messages) <= MOST_MESSAGES:
            return errno.EINVAL
        for index, message in enumerate(messages):
            if isinstance(message, int):
                length, is_early_read = message, index != last
            else:
                length, is_early_read = len(message), False
            if not 0 < length <= LONGEST_MESSAGE:
                if length != 0:
                    return errno.EINVAL
                if not (self.empty_read if isinstance(message, int) else self.empty_write):
                    return errno.EOPNOTSUPP
            if is_early_read and self.read_must_be_last:
                return errno.EOPNOTSUPP
        return None


ADAPTERS: Mapping[str, AdapterProfile] = {
    "bcm2835": AdapterProfile(
        EREMOTEIO,
        EREMOTEIO,
        errno.ETIMEDOUT,
        0x0EFF0009,
        read_must_be_last=True,
    ),
    "designware": AdapterProfile(
        EREMOTEIO,
        EREMOTEIO,
        errno.ETIMEDOUT,
        0x0F7E0003,
        empty_write=False,
        empty_read=False,
    ),
    "i2c-gpio": AdapterProfile(errno.ENXIO, errno.EIO, errno.ETIMEDOUT, 0x0FFF801F),
    "i2c-tiny-usb": AdapterProfile(
        errno.ENXIO, errno.ENXIO, errno.EIO, 0x0EFF0009, empty_read=False
    ),
}
