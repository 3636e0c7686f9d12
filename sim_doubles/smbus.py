"""`smbus2.SMBus` and `smbus.SMBus` on doubles: the same calls, the same bytes on the wire.

    from sim_doubles import plug
    from sim_doubles.smbus import SMBus

    with plug(1, [Pca9685Double(monotonic_ns)]), SMBus(1) as bus:
        bus.write_byte_data(0x40, 0x00, 0x20)

What the kernel's i2c-dev and its SMBus emulation make of a call is done here: word order, block
limits, packet error codes, which calls an adapter has (`funcs`), errno by adapter. Sources: smbus2
0.6.1; Linux 6.1 drivers/i2c/i2c-dev.c, i2c-core-smbus.c; SMBus 2.0.

Not modelled: a kernel driver that holds an address, so `force` changes nothing; 10-bit addresses.
An adapter without SMBus block reads (bcm2835, i2c-tiny-usb) refuses them with EOPNOTSUPP; the real
bcm2835 reads the length, then nothing, and calls that success.
"""

import ctypes
import errno
import os
from collections.abc import Sequence
from operator import index

from firmware_runtime.hal.i2c import Message
from firmware_runtime.system.resources import Closing
from sim_doubles import plugged
from sim_doubles.early import placeholder
from sim_doubles.i2c_bus import BlockRead, I2cBusDouble
from sim_doubles.packet_error_code import transfer_checked
from sim_doubles.smbus_messages import I2C_M_RD, I2cFunc, i2c_msg

__all__ = ["I2cFunc", "SMBus", "i2c_msg"]

I2C_SMBUS_BLOCK_MAX = 32


class SMBus(Closing):
    """A bus by its number or the path of its device node; without one call `open`.

    Raises FileNotFoundError where nothing is plugged in (`sim_doubles.plug`).
    """

    _path = ""

    def __init__(self, bus: int | str | None = None, force: bool = False) -> None:
        self.fd: int | None = None
        self.funcs: int = I2cFunc(0)
        self.address: int | None = None
        self.force = force
        self._force_last: bool | None = None
        self._pec = 0
        if bus is not None:
            self.open(bus)

    def open(self, bus: int | str) -> None:
        """Open a bus. Raises TypeError for what is neither number nor path."""
        if not isinstance(bus, int | str):
            raise TypeError(f"Unexpected type(bus)={type(bus)}")
        self._path = plugged.path_of(bus)
        self.funcs = plugged.functions(self._path)
        self.fd = placeholder()

    def close(self) -> None:
        """Close the bus; twice is harmless."""
        if self.fd is not None:
            os.close(self.fd)
        self.fd = self.address = self._force_last = None
        self._pec = 0

    # Packet error codes

    def enable_pec(self, enable: bool = True) -> None:
        """Add packet error codes from now on, or stop. Raises OSError if the adapter cannot."""
        if not self.funcs & I2cFunc.SMBUS_PEC:
            raise OSError("SMBUS_PEC is not a feature")
        self._pec = int(enable)

    def _get_pec(self) -> int:
        return self._pec

    pec = property(_get_pec, enable_pec)
    """Whether packet error codes are added, 1 or 0; also to set."""

    # One byte, or none

    def write_quick(self, i2c_addr: int, force: bool | None = None) -> None:
        """START, address+W, STOP."""
        self._select(i2c_addr, force)
        self._bus().transfer(i2c_addr, (b"",))

    def read_byte(self, i2c_addr: int, force: bool | None = None) -> int:
        """Read one byte, from where the chip's pointer is."""
        return self._smbus(i2c_addr, force, 1)[0]

    def write_byte(self, i2c_addr: int, value: int, force: bool | None = None) -> None:
        """Write one byte, to most chips their pointer."""
        self._smbus(i2c_addr, force, _byte(value))

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        """Read one byte of a register."""
        return self._smbus(i2c_addr, force, _byte(register), 1)[0]

    def write_byte_data(
        self, i2c_addr: int, register: int, value: int, force: bool | None = None
    ) -> None:
        """Write one byte to a register."""
        self._smbus(i2c_addr, force, _byte(register) + _byte(value))

    # Words, low byte first

    def read_word_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        """Read two bytes from a register."""
        return int.from_bytes(self._smbus(i2c_addr, force, _byte(register), 2), "little")

    def write_word_data(
        self, i2c_addr: int, register: int, value: int, force: bool | None = None
    ) -> None:
        """Write two bytes to a register."""
        self._smbus(i2c_addr, force, _byte(register) + _word(value))

    def process_call(
        self, i2c_addr: int, register: int, value: int, force: bool | None = None
    ) -> int:
        """Write a word and read one in the same transaction."""
        answer = self._smbus(i2c_addr, force, _byte(register) + _word(value), 2)
        return int.from_bytes(answer, "little")

    # Blocks of at most 32 bytes with their length before them

    def read_block_data(self, i2c_addr: int, register: int, force: bool | None = None) -> list[int]:
        """Read a block, as long as the chip says."""
        return self._block(i2c_addr, force, _byte(register), I2cFunc.SMBUS_READ_BLOCK_DATA)

    def write_block_data(
        self, i2c_addr: int, register: int, data: Sequence[int], force: bool | None = None
    ) -> None:
        """Write a block, its length first. Raises ValueError for more than 32 bytes."""
        self._smbus(i2c_addr, force, _byte(register) + _counted(data))

    def block_process_call(
        self, i2c_addr: int, register: int, data: Sequence[int], force: bool | None = None
    ) -> list[int]:
        """Write a block and read one in the same transaction. Raises ValueError as above."""
        written = _byte(register) + _counted(data)
        return self._block(i2c_addr, force, written, I2cFunc.SMBUS_BLOCK_PROC_CALL)

    # Blocks without a length; nothing is checked by a packet error code

    def read_i2c_block_data(
        self,
        i2c_addr: int,
        register: int,
        length: int = I2C_SMBUS_BLOCK_MAX,
        force: bool | None = None,
    ) -> list[int]:
        """Read a burst. Raises ValueError for more than 32 bytes. Only smbus has the default."""
        if length > I2C_SMBUS_BLOCK_MAX:
            raise ValueError(f"Desired block length over {I2C_SMBUS_BLOCK_MAX} bytes")
        self._select(i2c_addr, force)
        return list(self._bus().transfer(i2c_addr, (_byte(register), length)))

    def write_i2c_block_data(
        self, i2c_addr: int, register: int, data: Sequence[int], force: bool | None = None
    ) -> None:
        """Write a burst. Raises ValueError for more than 32 bytes."""
        written = _byte(register) + _block(data)
        self._select(i2c_addr, force)
        self._bus().transfer(i2c_addr, (written,))

    # Messages

    def i2c_rdwr(self, *i2c_msgs: i2c_msg) -> None:
        """Carry out messages as one transaction; what was read is in those that read."""
        parts = [(msg.addr, msg.len if msg.flags & I2C_M_RD else bytes(msg)) for msg in i2c_msgs]
        if not parts:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        answer = self._bus().transfer_parts(parts)
        for msg in i2c_msgs:
            if msg.flags & I2C_M_RD:
                ctypes.memmove(msg.buf, answer, msg.len)
                answer = answer[msg.len :]

    # How each of them goes

    def _select(self, address: int, force: bool | None) -> None:
        """Choose the address, as the ioctl I2C_SLAVE does."""
        self._bus()
        if not 0 <= address <= 0x7F:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        self.address = address
        self._force_last = self.force if force is None else force

    def _bus(self) -> I2cBusDouble:
        if self.fd is None:
            raise TypeError("argument must be an int, or have a fileno() method.")
        return plugged.bus_at(self._path)

    def _smbus(self, address: int, force: bool | None, *messages: Message) -> bytes:
        self._select(address, force)
        if self._pec:
            return transfer_checked(self._bus(), address, messages)
        return self._bus().transfer(address, messages)

    def _block(
        self, address: int, force: bool | None, written: bytes, needed: I2cFunc
    ) -> list[int]:
        self._select(address, force)
        if not self.funcs & needed:
            raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))
        return list(self._smbus(address, force, written, BlockRead(1)))[1:]


def _byte(value: int) -> bytes:
    """The low eight bits of a number, all that fits the field of the ioctl."""
    return bytes([index(value) & 0xFF])


def _word(value: int) -> bytes:
    return (index(value) & 0xFFFF).to_bytes(2, "little")


def _block(data: Sequence[int]) -> bytes:
    if len(data) > I2C_SMBUS_BLOCK_MAX:
        raise ValueError(f"Data length cannot exceed {I2C_SMBUS_BLOCK_MAX} bytes")
    return b"".join(map(_byte, data))


def _counted(data: Sequence[int]) -> bytes:
    block = _block(data)
    return bytes([len(block)]) + block
