"""The client's side of served doubles: buses and ports that look to a driver like any other."""

import errno
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TypeAlias

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.interlock import EnableLine
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.served.packets import (
    Answered,
    Asked,
    Conclude,
    Concluded,
    Done,
    Enable,
    Failed,
    Look,
    Read,
    Standing,
    Transfer,
    Write,
)
from firmware_runtime.hal.wire_errors import BusFault, HalError, from_os_error

Ask: TypeAlias = Callable[[Asked, str], Answered]
"""Asks a server; the text is what the sentence of an error begins with."""


class ServedBus(I2cBus):
    """An I2C bus of served doubles; errors are those of the bus itself, and the server's absence.

    One transaction is one question and one answer, which comes at once.
    """

    returns_early = True

    def __init__(self, name: str, ask: Ask) -> None:
        self.name = name
        self._ask = ask
        self._closed = False

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Have one transaction carried out; return what was read, in order, joined."""
        where = f"{self.name} 0x{address:02x}"
        if self._closed:
            raise _error(errno.EBADF, where)
        return _data(self._ask(Transfer(self.name, address, tuple(messages)), where), where)

    def close(self) -> None:
        """Release the bus; the targets go on as they are."""
        self._closed = True


class ServedPort(SerialPort):
    """A serial port of served doubles; what arrived before it was opened is thrown away."""

    def __init__(self, name: str, ask: Ask) -> None:
        self.name = name
        self._ask = ask
        self._closed = False
        self.discard_input()

    def write(self, data: bytes) -> None:
        """Send bytes to the target; they have arrived when this returns."""
        self._carry_out(Write(self.name, bytes(data)))

    def read_available(self) -> bytes:
        """Take what has arrived by now."""
        return self._carry_out(Read(self.name))

    def close(self) -> None:
        """Release the port; the target goes on as it is."""
        self._closed = True

    def _carry_out(self, asked: Write | Read) -> bytes:
        if self._closed:
            raise _error(errno.EBADF, self.name)
        return _data(self._ask(asked, self.name), self.name)


class ServedEnableLine(EnableLine):
    """The line that lets served outputs through; the server frees it when this client goes."""

    def __init__(self, name: str, ask: Ask) -> None:
        self.name = name
        self._ask = ask
        self._closed = False

    def set(self, enabled: bool) -> None:  # noqa: FBT001 -- a line has two levels
        """Let outputs through or not."""
        if self._closed:
            raise _error(errno.EBADF, self.name)
        _data(self._ask(Enable(enabled), self.name), self.name)

    def close(self) -> None:
        """Disable the outputs; closing twice is harmless."""
        if not self._closed:
            with suppress(HalError):  # the server has gone
                self.set(False)
            self._closed = True


class ServedDoubles:
    """One board's doubles in another process: its lines, its outputs, how a run on it ended.

    `disconnect` ends the connection to the server.
    """

    def __init__(
        self,
        ask: Ask,
        buses: Iterable[str],
        ports: Iterable[str],
        *,
        has_enable_line: bool = False,
        disconnect: Callable[[], None] = lambda: None,
    ) -> None:
        self._ask = ask
        self._disconnect = disconnect
        self.enable = ServedEnableLine("output_enable", ask) if has_enable_line else None
        self.buses: Mapping[str, I2cBus] = {name: ServedBus(name, ask) for name in buses}
        self.ports: Mapping[str, SerialPort] = {name: ServedPort(name, ask) for name in ports}

    @property
    def outputs(self) -> dict[str, int]:
        """Number of outputs of each actuating chip are on. Raises BusTimeout, BusAbsent."""
        return look(self._ask).outputs

    def result(self, elapsed: int, own: Mapping[str, object]) -> dict[str, object]:
        """Return how a run of `elapsed` ns ended. Raises BusTimeout, BusAbsent."""
        answered = self._ask(Conclude(elapsed, dict(own)), "doubles")
        if isinstance(answered, Concluded):
            return answered.result
        raise _unexpected(answered, "doubles")

    def close(self) -> None:
        """Disconnect from the server."""
        self._disconnect()


def look(ask: Ask) -> Standing:
    """Return how things stand now with the doubles served. Raises BusTimeout, BusAbsent."""
    answered = ask(Look(), "doubles")
    if isinstance(answered, Standing):
        return answered
    raise _unexpected(answered, "doubles")


def _data(answered: Answered, where: str) -> bytes:
    """Return what was read. Raises the error a bus of this process raises."""
    match answered:
        case Done(data):
            return data
        case Failed(number):
            raise _error(number, where)
    raise _unexpected(answered, where)


def _error(number: int, where: str) -> HalError:
    return from_os_error(OSError(number, os.strerror(number)), where)


def _unexpected(answered: Answered, where: str) -> BusFault:
    return BusFault(f"the doubles answered {answered}", where=where, expected="an answer that fits")
