"""The packet error code of SMBus: a CRC-8 over all bytes of a transaction, addresses included.

Polynomial x8 + x2 + x + 1, from 0. Source: SMBus 2.0, 5.3.7; Linux 6.1, i2c-core-smbus.c.
"""

import errno
import os
from collections.abc import Sequence

from firmware_runtime.hal.i2c import Message
from sim_doubles.i2c_bus import I2cBusDouble


def packet_error_code(data: bytes) -> int:
    """Return the code of these bytes."""
    code = 0
    for byte in data:
        code ^= byte
        for _ in range(8):
            code = code << 1 ^ (0x107 if code & 0x80 else 0)
    return code


def transfer_checked(bus: I2cBusDouble, address: int, messages: Sequence[Message]) -> bytes:
    """Carry out one transaction with a code at its end; return what was read without it.

    Raises OSError, with EBADMSG if the code that was read is wrong.
    """
    *written, last = messages
    sent = b"".join(bytes([address << 1]) + each for each in written if isinstance(each, bytes))
    if isinstance(last, bytes):
        code = packet_error_code(sent + bytes([address << 1]) + last)
        return bus.transfer(address, (*written, last + bytes([code])))
    answer = bus.transfer(address, (*written, type(last)(last + 1)))
    if packet_error_code(sent + bytes([address << 1 | 1]) + answer):
        raise OSError(errno.EBADMSG, os.strerror(errno.EBADMSG))
    return answer[:-1]
