"""Errors of Linux I2C adapters: the same event has another errno on each of them.

Source: Linux 6.1 drivers/i2c/busses (bcm2835, designware, tiny-usb), algos/i2c-algo-bit, i2c-dev.
Where a firmware decides (refused byte on i2c-tiny-usb) the errno of a refused address is taken.
"""

import errno
from collections.abc import Mapping, Sequence

from msgspec import Struct

from firmware_runtime.hal.i2c import Message

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
        errno.EREMOTEIO,
        errno.EREMOTEIO,
        errno.ETIMEDOUT,
        0x0EFF0009,
        read_must_be_last=True,
    ),
    "designware": AdapterProfile(
        errno.EREMOTEIO,
        errno.EREMOTEIO,
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
