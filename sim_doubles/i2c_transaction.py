"""Bytes on the wire between one START and its STOP, as the bus double logs them."""

from msgspec import Struct

from firmware_runtime.hal.i2c import Message


class BlockRead(int):
    """A read whose first byte is how many follow: an SMBus block. Its value is the bytes beside.

    1 is the length alone, 2 a packet error code too. Source: I2C_M_RECV_LEN of Linux.
    """


class Transaction(Struct, frozen=True):
    """One logged transaction: `answer` is what was read, `error` the errno it ended with."""

    at: int
    address: int
    messages: tuple[Message, ...]
    answer: bytes
    error: int | None

    @property
    def written(self) -> bytes:
        """The bytes the controller meant to write, joined."""
        return b"".join(message for message in self.messages if isinstance(message, bytes))

    @property
    def to_read(self) -> int:
        """The number of bytes the controller meant to read."""
        return sum(message for message in self.messages if isinstance(message, int))

    def __str__(self) -> str:
        """Direction and bytes in order, for people: `0x68 W 3a, R 01 02`."""
        parts, read = [], 0
        for message in self.messages:
            if isinstance(message, int):
                end = None if isinstance(message, BlockRead) else read + message
                parts.append(f"R {self.answer[read:end].hex(' ')}".rstrip())
                read += message
            else:
                parts.append(f"W {message.hex(' ')}".rstrip())
        ending = "" if self.error is None else f" -> errno {self.error}"
        return f"0x{self.address:02x} {', '.join(parts)}{ending}"
