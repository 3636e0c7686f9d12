"""USB/IP once a device is attached: requests in, answers out, no I/O.

A request is a header of 48 bytes in network byte order, and after it the data of an OUT transfer;
an answer likewise, with the data of an IN transfer. Inside the header the 8 bytes of the setup
packet are as on the wire of USB, least significant byte first.
Source: Linux documentation, usb/usbip_protocol.
"""

import errno
import struct
from dataclasses import dataclass
from typing import Final, Protocol

from sim_doubles.served.logs import ServingError

SUBMIT: Final = 1
UNLINK: Final = 2
SUBMITTED: Final = 3
UNLINKED: Final = 4
IN: Final = 1

HEADER: Final = struct.Struct(">5I28s")
"""Command, number, device, direction, endpoint; then what belongs to the command."""
_SUBMIT: Final = struct.Struct(">Iiiii8s")  # flags, length, frame, packets, interval, setup
_SUBMITTED: Final = struct.Struct(">5I5i8x")  # ..., status, length, frame, packets, errors
_UNLINKED: Final = struct.Struct(">5Ii24x")  # ..., status
_SETUP: Final = struct.Struct("<BBHHH")

LONGEST: Final = 65_535
"""Bytes a control transfer can carry; its length is 16 bits wide."""


class Stalled(Exception):
    """The device refuses a request, as USB says: the host sees EPIPE."""


class NotUsbip(ServingError):
    """Arrival of bytes that are no request of USB/IP."""


class NotAttached(ServingError):
    """The kernel did not take the device, or let go of it."""


@dataclass(frozen=True, slots=True)
class Setup:
    """A control request, its fields as USB names them."""

    request_type: int
    request: int
    value: int
    index: int
    length: int


class Device(Protocol):
    """Device that answers control requests; endpoint 0 is the only one."""

    def control(self, setup: Setup, written: bytes) -> bytes:
        """Answer with what an IN request reads, at most its length. Raises Stalled."""


class Conversation:
    """One device's end of the connection; bytes may come in pieces of any size."""

    def __init__(self, device: Device) -> None:
        self._device = device
        self._received = bytearray()

    def receive(self, data: bytes) -> bytes:
        """Take what arrived; return the answers to all requests that are whole by now.

        Requests are carried out in order, each before the next is looked at. Raises NotUsbip; then
        nothing that follows can be understood.
        """
        self._received += data
        answers = bytearray()
        while (end := self._end_of_request()) is not None:
            request = bytes(self._received[:end])
            del self._received[:end]
            answers += self._answer(request)
        return bytes(answers)

    def _end_of_request(self) -> int | None:
        """Return the end of the first request, None if the rest of it has not come."""
        if len(self._received) < HEADER.size:
            return None
        command, _, _, direction, _, rest = HEADER.unpack_from(self._received)
        if command == UNLINK:
            return HEADER.size
        if command != SUBMIT:
            raise NotUsbip(f"USB/IP: command {command}, expected {SUBMIT} or {UNLINK}")
        _, length, _, _, _, _ = _SUBMIT.unpack(rest)
        if not 0 <= length <= LONGEST:
            raise NotUsbip(f"USB/IP: a transfer of {length} bytes, expected 0 to {LONGEST}")
        end: int = HEADER.size + (0 if direction == IN else length)
        return end if len(self._received) >= end else None

    def _answer(self, request: bytes) -> bytes:
        command, number, _, direction, endpoint, rest = HEADER.unpack_from(request)
        if command == UNLINK:  # answered before it was withdrawn, as every request is
            return _UNLINKED.pack(UNLINKED, number, 0, 0, 0, 0)
        _, length, _, _, _, setup = _SUBMIT.unpack(rest)
        written = request[HEADER.size :]
        if endpoint != 0:
            return _submitted(number, -errno.EPIPE, 0)
        try:
            read = self._device.control(Setup(*_SETUP.unpack(setup)), written)[:length]
        except Stalled:
            return _submitted(number, -errno.EPIPE, 0)
        return _submitted(number, 0, len(read if direction == IN else written)) + read


def _submitted(number: int, status: int, length: int) -> bytes:
    return _SUBMITTED.pack(SUBMITTED, number, 0, 0, 0, status, length, 0, 0, 0)
