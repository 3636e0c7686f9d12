"""The serial port a driver speaks: bytes out, bytes in, and never a wait for what may not come.

There is no framing here and no time. A write hands its bytes to the port's output buffer; reading
takes what has arrived since the last time, which may be part of a frame, several frames, or
nothing. Turning bytes into values is the chips' codecs' part.
"""

from abc import ABC, abstractmethod
from typing import NoReturn, SupportsIndex

BITS_PER_BYTE = 10
"""On the line: start, eight of data, stop."""


class SerialPort(ABC):
    """A port by its name, as in board.toml and in every error; 8 data bits, no parity, 1 stop."""

    name: str

    def __reduce_ex__(self, _protocol: SupportsIndex) -> NoReturn:
        """Refuse to be copied: a port is no state of the model that speaks to it."""
        raise TypeError(f"{self.name}: a port cannot be copied or kept")

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Hand all bytes to the output buffer; they leave at the port's own pace afterwards.

        Bounded: raises BusTimeout if the buffer does not take them, and some may have left then.
        Raises BusFault if the port fails, PortClosed after `close`.
        """

    @abstractmethod
    def read_available(self) -> bytes:
        """Take what has arrived, in order; b"" when nothing has. Never blocks.

        Raises BusFault if the port fails, PortClosed after `close`.
        """

    def discard_input(self) -> None:
        """Throw away what has arrived and was not read; it may be of any age."""
        while self.read_available():
            pass

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way until what was written has left.

        0 on a port that belongs to no run.
        """
        return 0

    @abstractmethod
    def close(self) -> None:
        """Release the port; using it afterwards raises PortClosed."""
