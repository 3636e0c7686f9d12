"""Buses of served doubles, each plugged into this machine as an adapter of its own."""

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from socket import AF_UNIX, SOCK_STREAM, socketpair
from typing import Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.served.packets import Done, Failed, Part, Question, encode, read_answer
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService
from sim_doubles.usbip.host_controller import HostController
from sim_doubles.usbip.i2c_tiny_usb import I2cTinyUsb, Piece, Transfer
from sim_doubles.usbip.packets import Conversation, NotAttached

TIMEOUT: Final = 30 * SECOND
"""Bound of the kernel's time to find a device and bind its driver: 0.2 s on a PC."""
_AT_ONCE: Final = 65_536


class PluggedBus:
    """One bus as an adapter of this machine; `serial` is what the kernel knows it by."""

    def __init__(self, serial: str, transfer: Transfer) -> None:
        self.serial = serial
        self._conversation = Conversation(I2cTinyUsb(serial, transfer))
        self.connection, self.kernels_end = socketpair(AF_UNIX, SOCK_STREAM)

    def plug_in(self, controller: HostController, number: int) -> int:
        """Give the kernel its end of the connection; return the port. Raises NotAttached."""
        with self.kernels_end:
            return controller.attach(self.kernels_end, number)

    def serve(self) -> None:
        """Answer the kernel's requests. Raises NotAttached when it has let go, NotUsbip."""
        received = b""
        with suppress(ConnectionError):
            received = self.connection.recv(_AT_ONCE)
            self.connection.sendall(self._conversation.receive(received))
        if not received:
            raise NotAttached(
                f"{self.serial}: the kernel let go of it, expected it to stay plugged in"
            )


@contextmanager
def plugged_in(
    board: str,
    buses: Sequence[str],
    service: DoublesService,
    server: DoublesServer,
    clock: RealClock,
) -> Iterator[dict[str, Path]]:
    """Plug in each bus, while `server` serves; yields device nodes by the buses' names.

    All are pulled out in the end. Raises NotAttached.
    """
    controller = HostController()
    devices: dict[str, Path] = {}
    with ExitStack() as resources:
        for number, bus in enumerate(buses, 1):
            plugged = PluggedBus(f"{board}.{bus}", transfer_of(service, bus))
            resources.callback(plugged.connection.close)
            server.watch(plugged.connection, plugged.serve)
            port = plugged.plug_in(controller, number)
            resources.callback(controller.detach, port)
            devices[bus] = _device_at(port, controller, server, clock)
        yield devices


def transfer_of(service: DoublesService, bus: str) -> Transfer:
    """Return a function that carries out transactions on a bus of served doubles."""

    def transfer(piece: Piece) -> bytes:
        asked = Part(bus, piece.messages, piece.continues, piece.holds)
        match read_answer(service.answer(encode(Question(0, asked)))).answered:
            case Done(data):
                return data
            case Failed(number):
                raise OSError(number, os.strerror(number))
            case unexpected:
                raise AssertionError(unexpected)

    return transfer


def _device_at(
    port: int, controller: HostController, server: DoublesServer, clock: RealClock
) -> Path:
    """The device node that the adapter has become; the kernel sends many requests until then."""
    give_up_at = clock.look() + TIMEOUT
    while (device := controller.i2c_device(port)) is None:
        if clock.look() > give_up_at:
            raise NotAttached(
                f"USB port {port}: no I2C adapter within {TIMEOUT // SECOND} s, expected the "
                "modules i2c-tiny-usb and i2c-dev to be loaded"
            )
        server.step()
    return device
