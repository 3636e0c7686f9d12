"""The kernel's side of USB/IP, in a few lines: URBs as bytes, transactions message by message."""

import errno
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from firmware_runtime.hal.i2c import Message
from sim_doubles.usbip.i2c_tiny_usb import I2cTinyUsb
from sim_doubles.usbip.packets import HEADER, Conversation
from sim_doubles.usbip.plugged import transfer_of
from tests.support.served_rig import ServedRig

IN, OUT = 1, 0
VENDOR_IN, VENDOR_OUT = 0xC1, 0x41
GET_FUNCTIONALITY, SET_DELAY, GET_STATUS, TRANSFER = 1, 2, 3, 4
FIRST, LAST = 1, 2
ACKNOWLEDGED, REFUSED = b"\x01", b"\x02"
PWM, SENSOR, FREE = 0x40, 0x68, 0x23


def submit(setup: Sequence[int], written: bytes = b"", number: int = 1, endpoint: int = 0) -> bytes:
    """CMD_SUBMIT of a control request: type, request, value, index, length."""
    direction = IN if setup[0] & 0x80 else OUT
    head = struct.pack(">5I", 1, number, 1, direction, endpoint)
    rest = struct.pack(">IiiiI", 0, setup[4], 0, 0, 0) + struct.pack("<BBHHH", *setup)
    return head + rest + written


def unlink(number: int, meant: int) -> bytes:
    return struct.pack(">6I24x", 2, number, 1, OUT, 0, meant)


@dataclass
class Answer:
    command: int
    number: int
    status: int
    read: bytes


def answers(data: bytes, *, reads: bool = True) -> list[Answer]:
    """What came back, whole."""
    found = []
    while data:
        command, number, device, direction, endpoint, _ = HEADER.unpack_from(data)
        assert (device, direction, endpoint) == (0, 0, 0)
        status, length = struct.unpack_from(">ii", data, 20)
        end = HEADER.size + (length if reads and command == 3 else 0)
        found.append(Answer(command, number, status, data[HEADER.size : end]))
        data = data[end:]
    return found


class Host:
    """The kernel's driver, in a few lines: a transaction goes message by message."""

    def __init__(self, conversation: Conversation) -> None:
        self._conversation = conversation

    def ask(self, setup: Sequence[int], written: bytes = b"") -> Answer:
        sent = self._conversation.receive(submit(setup, written))
        (answer,) = answers(sent, reads=bool(setup[0] & 0x80))
        return answer

    def read(self, request: int, value: int, index: int, length: int) -> Answer:
        return self.ask((VENDOR_IN, request, value, index, length))

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes | int:
        """What was read, or the errno that the caller of the kernel gets."""
        read = b""
        for index, message in enumerate(messages):
            request = TRANSFER + FIRST * (index == 0) + LAST * (index == len(messages) - 1)
            if isinstance(message, int):
                answer = self.read(request, 1, address, message)
                read += answer.read
            else:
                answer = self.ask((VENDOR_OUT, request, 0, address, len(message)), message)
            if answer.status != 0:
                return errno.EIO
            if self.read(GET_STATUS, 0, 0, 1).read == REFUSED:
                return errno.ENXIO
        return read


def host_of(rig: ServedRig) -> Host:
    return Host(Conversation(I2cTinyUsb("tachobot.i2c1", transfer_of(rig.service, "i2c1"))))
