"""A device at the other end of a serial line, as the line sees it: bytes in, bytes out."""

from abc import ABC, abstractmethod


class SerialTarget(ABC):
    """Anything with a serial port of its own; what it sends by itself is worked out when read."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take bytes from the host, now."""

    @abstractmethod
    def transmitted(self, at: int) -> bytes:
        """Return the bytes whose last bit is out by `at` and that were not returned before."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose supply and get it back: everything volatile is at its power-up value."""
