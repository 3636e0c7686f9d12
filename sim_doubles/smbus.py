"""`smbus2.SMBus` and `smbus.SMBus` on doubles: smbus2 itself, and doubles in the kernel's place.

    from sim_doubles import plug
    from sim_doubles.smbus import SMBus

    with plug(1, [Pca9685Double(monotonic_ns)]), SMBus(1) as bus:
        bus.write_byte_data(0x40, 0x00, 0x20)

Calls and their checks are smbus2's own; its system calls are answered here as the kernel's i2c-dev
and its SMBus emulation do: word order, packet error codes, which calls an adapter has, errno by
adapter. Sources: Linux 6.1 drivers/i2c/i2c-dev.c, i2c-core-smbus.c; SMBus 2.0.

Not modelled: a kernel driver that holds an address, so `force` changes nothing; 10-bit addresses.
An adapter without SMBus block reads (bcm2835, i2c-tiny-usb) refuses them with EOPNOTSUPP; the real
bcm2835 reads the length, then nothing, and calls that success.
"""

import ctypes
import errno
import fcntl
from collections.abc import Sequence
from typing import Any, Final

import smbus2
from smbus2 import I2cFunc, i2c_msg
from smbus2 import smbus2 as system

from firmware_runtime.hal.i2c import Message
from sim_doubles import plugged
from sim_doubles.early import OpenBus
from sim_doubles.i2c_bus import BlockRead, I2cBusDouble
from sim_doubles.i2c_wire import os_error

__all__ = ["I2cFunc", "SMBus", "i2c_msg"]

_CALLS: Final = {system.I2C_SMBUS_PROC_CALL, system.I2C_SMBUS_BLOCK_PROC_CALL}
"""Kinds of call that write and read in one transaction."""
_UNCHECKED: Final = {system.I2C_SMBUS_QUICK, system.I2C_SMBUS_I2C_BLOCK_DATA}
"""Kinds of call without a packet error code."""
_BLOCKS: Final = {
    system.I2C_SMBUS_BLOCK_DATA: I2cFunc.SMBUS_READ_BLOCK_DATA,
    system.I2C_SMBUS_BLOCK_PROC_CALL: I2cFunc.SMBUS_BLOCK_PROC_CALL,
}
"""Kinds of call that read as many bytes as the chip says, and the function each needs."""


class SMBus(smbus2.SMBus):
    """A bus by its number or the path of its device node; without one call `open`.

    Raises FileNotFoundError where nothing is plugged in (`sim_doubles.plug`).
    """

    def open(self, bus: int | str) -> None:
        """Open a bus. Raises TypeError for what is neither number nor path."""
        if not isinstance(bus, int | str):
            raise TypeError(f"Unexpected type(bus)={type(bus)}")
        path = plugged.path_of(bus)
        self.funcs = I2cFunc(plugged.functions(path))
        self.fd = OpenBus.of_nothing(path)

    def read_i2c_block_data(
        self,
        i2c_addr: int,
        register: int,
        length: int = system.I2C_SMBUS_BLOCK_MAX,
        force: bool | None = None,
    ) -> list[int]:
        """Read a burst. Raises ValueError for more than 32 bytes. Only smbus has the default."""
        return super().read_i2c_block_data(i2c_addr, register, length, force)


def ioctl(descriptor: Any, request: int, argument: Any = 0) -> int:  # noqa: ANN401 -- as fcntl's
    """Answer a system call of smbus2: by the doubles behind an open bus, else by the kernel."""
    if not isinstance(descriptor, OpenBus) or not plugged.answers_at(descriptor):
        return int(fcntl.ioctl(descriptor, request, argument))
    bus = plugged.bus_at(descriptor.path)
    match request:
        case system.I2C_SLAVE | system.I2C_SLAVE_FORCE:
            if not 0 <= argument <= 0x7F:
                raise os_error(errno.EINVAL)
            descriptor.address = argument
        case system.I2C_FUNCS:
            argument.value = bus.adapter.functions
        case system.I2C_PEC:
            descriptor.has_codes = bool(argument)
        case system.I2C_RDWR:
            _combine(bus, [argument.msgs[index] for index in range(argument.nmsgs)])
        case system.I2C_SMBUS:
            _emulate(bus, descriptor, argument)
    return 0


vars(system)["ioctl"] = ioctl


def _combine(bus: I2cBusDouble, msgs: Sequence[Any]) -> None:
    """Carry out messages as one transaction; what was read is in those that read."""
    if not msgs:
        raise os_error(errno.EINVAL)
    parts = [(msg.addr, msg.len if msg.flags & system.I2C_M_RD else bytes(msg)) for msg in msgs]
    answer = bus.transfer_parts(parts)
    for msg in msgs:
        if msg.flags & system.I2C_M_RD:
            ctypes.memmove(msg.buf, answer, msg.len)
            answer = answer[msg.len :]


def _emulate(bus: I2cBusDouble, descriptor: OpenBus, call: Any) -> None:  # noqa: ANN401 -- ctypes
    """Carry out an SMBus call by plain messages; what was read is in its data."""
    size, data, command = call.size, call.data.contents, bytes([call.command])
    is_read = call.read_write == system.I2C_SMBUS_READ
    block = bytes(data.block[: data.block[0] + 1])
    if (is_read or size in _CALLS) and not bus.adapter.functions & _BLOCKS.get(size, -1):
        raise os_error(errno.EOPNOTSUPP)
    sent = {
        system.I2C_SMBUS_QUICK: b"",
        system.I2C_SMBUS_BYTE: command,
        system.I2C_SMBUS_BYTE_DATA: command + bytes([data.byte]),
        system.I2C_SMBUS_WORD_DATA: command + data.word.to_bytes(2, "little"),
        system.I2C_SMBUS_PROC_CALL: command + data.word.to_bytes(2, "little"),
        system.I2C_SMBUS_I2C_BLOCK_DATA: command + block[1:],
    }.get(size, command + block)
    lengths: dict[int, int] = {
        system.I2C_SMBUS_WORD_DATA: 2,
        system.I2C_SMBUS_PROC_CALL: 2,
        system.I2C_SMBUS_I2C_BLOCK_DATA: block[0],
        **dict.fromkeys(_BLOCKS, BlockRead(1)),
    }
    messages: tuple[Message, ...] = (sent,)
    if is_read:
        messages = () if size == system.I2C_SMBUS_BYTE else (command,)
    if is_read or size in _CALLS:
        messages = (*messages, lengths.get(size, 1))
    has_code = descriptor.has_codes and size not in _UNCHECKED
    transfer = transfer_checked if has_code else I2cBusDouble.transfer
    answer = transfer(bus, descriptor.address, messages)
    begin = 1 if size == system.I2C_SMBUS_I2C_BLOCK_DATA else 0
    data.block[begin : begin + len(answer)] = list(answer)  # of a word the low byte is first


def packet_error_code(data: bytes) -> int:
    """Return the CRC-8 of a transaction's bytes, addresses included: x8 + x2 + x + 1, from 0.

    Source: SMBus 2.0, 5.3.7.
    """
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
        raise os_error(errno.EBADMSG)
    return answer[:-1]
