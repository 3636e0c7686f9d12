"""The kernel under the real smbus2: its ioctls, answered by a bus of doubles.

Decodes what smbus2 lays out in memory; a second opinion on what `sim_doubles.smbus` sends.
Source: Linux 6.1, drivers/i2c/i2c-core-smbus.c and i2c-dev.c.
"""

import ctypes
import errno
import os
from types import SimpleNamespace
from typing import Any

import pytest
import smbus2

from sim_doubles.i2c_bus import I2cBusDouble

PROC_CALL = 4
DESCRIPTOR = 700


class KernelI2c:
    """One open device node."""

    def __init__(self, bus: I2cBusDouble) -> None:
        self._bus = bus
        self._address = 0

    def ioctl(self, descriptor: int, request: int, argument: Any = 0) -> int:  # noqa: ANN401
        if descriptor != DESCRIPTOR:
            raise TypeError("argument must be an int, or have a fileno() method.")
        match request:
            case 0x0703 | 0x0706:
                if argument > 0x7F:
                    raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
                self._address = argument
            case 0x0705:
                argument.value = self._bus.adapter.functions
            case 0x0707:
                self._combined([argument.msgs[index] for index in range(argument.nmsgs)])
            case 0x0720:
                self._smbus(argument)
        return 0

    def _combined(self, msgs: list[Any]) -> None:
        parts = [(m.addr, m.len if m.flags & 1 else ctypes.string_at(m.buf, m.len)) for m in msgs]
        answer = self._bus.transfer_parts(parts)
        for m in msgs:
            if m.flags & 1:
                ctypes.memmove(m.buf, answer, m.len)
                answer = answer[m.len :]

    def _smbus(self, call: Any) -> None:  # noqa: ANN401, C901 -- one case a kind of transfer
        data, command = call.data.contents, bytes([call.command])
        word = data.word.to_bytes(2, "little")
        block = bytes(data.block[1 : data.block[0] + 1])
        match call.size, call.read_write:
            case (0, 0):
                self._bus.transfer(self._address, [b""])
            case (1, 0):
                self._bus.transfer(self._address, [command])
            case (1, 1):
                data.byte = self._bus.transfer(self._address, [1])[0]
            case (2, 0):
                self._bus.transfer(self._address, [command + bytes([data.byte])])
            case (2, 1):
                data.byte = self._bus.transfer(self._address, [command, 1])[0]
            case (3, 0):
                self._bus.transfer(self._address, [command + word])
            case (3, 1) | (4, 0):
                sent = command + (word if call.size == PROC_CALL else b"")
                data.word = int.from_bytes(self._bus.transfer(self._address, [sent, 2]), "little")
            case (5, 0):
                self._bus.transfer(self._address, [command + bytes([len(block)]) + block])
            case (8, 0):
                self._bus.transfer(self._address, [command + block])
            case (8, 1):
                answer = self._bus.transfer(self._address, [command, data.block[0]])
                data.block[1 : len(answer) + 1] = list(answer)


def real_smbus(patch: pytest.MonkeyPatch, bus: I2cBusDouble) -> smbus2.SMBus:
    """The real smbus2 on this bus."""
    patch.setattr("smbus2.smbus2.ioctl", KernelI2c(bus).ioctl)
    files = SimpleNamespace(open=lambda *_: DESCRIPTOR, close=lambda _: None, O_RDWR=os.O_RDWR)
    patch.setattr("smbus2.smbus2.os", files)
    return smbus2.SMBus(1)
