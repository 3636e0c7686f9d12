"""Absent lines that note what is used: a part that is replayed must have none to use."""

from collections.abc import Sequence

from msgspec.structs import replace

from firmware_runtime.board.lines import Lines
from firmware_runtime.board.registry import Board
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.serial import SerialPort


def noting_lines(board: Board, uses: list[str]) -> Lines:
    """Lines of a board on which nothing can be sent; `uses` gets the name of each one used."""
    absent = board.absent_lines()

    def interlock() -> bool:
        uses.append("the interlock")
        return False

    return replace(
        absent,
        buses={name: _NotingBus(bus, uses) for name, bus in absent.buses.items()},
        ports={name: _NotingPort(port, uses) for name, port in absent.ports.items()},
        interlock=interlock,
    )


class _NotingBus(I2cBus):
    """Notes each transaction, and refuses it as the absent bus below does."""

    def __init__(self, absent: I2cBus, uses: list[str]) -> None:
        self.name = absent.name
        self._absent = absent
        self._uses = uses

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Note it, and refuse."""
        self._uses.append(f"bus {self.name}")
        return self._absent.transaction(address, messages)


class _NotingPort(SerialPort):
    """Notes each write and read, and refuses it as the absent port below does."""

    def __init__(self, absent: SerialPort, uses: list[str]) -> None:
        self.name = absent.name
        self._absent = absent
        self._uses = uses

    def write(self, data: bytes) -> None:
        """Note it, and refuse."""
        self._uses.append(f"port {self.name}")
        self._absent.write(data)

    def read_available(self) -> bytes:
        """Note it, and refuse."""
        self._uses.append(f"port {self.name}")
        return self._absent.read_available()

    def close(self) -> None:
        """There is nothing to release."""
