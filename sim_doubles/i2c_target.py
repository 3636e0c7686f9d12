"""A target on an I2C bus, as the wire sees it: START, bytes, acknowledges, STOP."""

from abc import ABC, abstractmethod


class Target(ABC):
    """Anything that may pull SDA low. It decides by itself which addresses it answers to.

    The bus offers every START to every target, so all-call, sub-addresses and general call need
    nothing from the bus. `write` and `read` follow only a `start` that was acknowledged.
    """

    is_connected: bool = True
    """False while a fault keeps it off every bus, that of another chip's own master included."""

    @abstractmethod
    def start(self, address: int, *, read: bool) -> bool:
        """Take a START or repeated START with its 7-bit address; True acknowledges it."""

    @abstractmethod
    def write(self, byte: int) -> bool:
        """Take one byte from the controller; False refuses it and ends the target's part."""

    @abstractmethod
    def read(self) -> int:
        """Put one byte on the bus; 0xFF leaves SDA released."""

    def write_bytes(self, message: bytes) -> int | None:
        """Take bytes up to one it refuses, whose index is returned; None if it took all.

        For a target that is alone in being addressed. One that can take many bytes at once in less
        time than one by one may, as long as nothing else differs.
        """
        for index, byte in enumerate(message):
            if not self.write(byte):
                return index
        return None

    def read_bytes(self, length: int) -> bytes:
        """Put so many bytes on the bus, likewise."""
        return bytes([self.read() for _ in range(length)])

    @abstractmethod
    def stop(self) -> None:
        """Take a STOP; it comes after every transaction, also one meant for another target."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose supply and get it back: everything volatile is at its power-up value."""
