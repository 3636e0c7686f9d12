"""The words of `sim_doubles.smbus`: what an adapter can do, and one message of a transaction."""

import ctypes
from collections.abc import Iterable, Iterator
from enum import IntFlag

I2C_M_RD = 0x0001


class I2cFunc(IntFlag):
    """What an adapter can do, as the ioctl I2C_FUNCS says it. Source: uapi/linux/i2c.h."""

    I2C = 0x00000001
    ADDR_10BIT = 0x00000002
    PROTOCOL_MANGLING = 0x00000004
    SMBUS_PEC = 0x00000008
    NOSTART = 0x00000010
    SLAVE = 0x00000020
    SMBUS_BLOCK_PROC_CALL = 0x00008000
    SMBUS_QUICK = 0x00010000
    SMBUS_READ_BYTE = 0x00020000
    SMBUS_WRITE_BYTE = 0x00040000
    SMBUS_READ_BYTE_DATA = 0x00080000
    SMBUS_WRITE_BYTE_DATA = 0x00100000
    SMBUS_READ_WORD_DATA = 0x00200000
    SMBUS_WRITE_WORD_DATA = 0x00400000
    SMBUS_PROC_CALL = 0x00800000
    SMBUS_READ_BLOCK_DATA = 0x01000000
    SMBUS_WRITE_BLOCK_DATA = 0x02000000
    SMBUS_READ_I2C_BLOCK = 0x04000000
    SMBUS_WRITE_I2C_BLOCK = 0x08000000
    SMBUS_HOST_NOTIFY = 0x10000000
    SMBUS_BYTE = 0x00060000
    SMBUS_BYTE_DATA = 0x00180000
    SMBUS_WORD_DATA = 0x00600000
    SMBUS_BLOCK_DATA = 0x03000000
    SMBUS_I2C_BLOCK = 0x0C000000
    SMBUS_EMUL = 0x0EFF0008


class i2c_msg(ctypes.Structure):  # noqa: N801 -- the name that drivers import
    """One message of `i2c_rdwr`; iterate over it, or take `bytes` of it, for what was read."""

    _fields_ = (
        ("addr", ctypes.c_uint16),
        ("flags", ctypes.c_uint16),
        ("len", ctypes.c_uint16),
        ("buf", ctypes.POINTER(ctypes.c_char)),
    )

    @staticmethod
    def read(address: int, length: int) -> "i2c_msg":
        """Return a message that reads `length` bytes."""
        return i2c_msg(address, I2C_M_RD, length, ctypes.create_string_buffer(length))

    @staticmethod
    def write(address: int, buf: "str | Iterable[int]") -> "i2c_msg":
        """Return a message that writes bytes, given as such, as numbers, or as a string of them."""
        data = buf.encode("latin-1") if isinstance(buf, str) else bytes(buf)
        return i2c_msg(address, 0, len(data), ctypes.create_string_buffer(data, len(data)))

    def __iter__(self) -> Iterator[int]:
        return iter(bytes(self))

    def __len__(self) -> int:
        return int(self.len)

    def __bytes__(self) -> bytes:
        return ctypes.string_at(self.buf, self.len)

    def __repr__(self) -> str:
        return f"i2c_msg({self.addr},{self.flags},{bytes(self)!r})"

    def __str__(self) -> str:
        return bytes(self).decode(errors="ignore")
