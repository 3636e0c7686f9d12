"""What faults do to one I2C transaction, put together before it goes on the wire."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from firmware_runtime.hal.i2c import Message
from sim_doubles.i2c_target import Target


@dataclass(slots=True)
class Alteration:
    """The sum of the faults due in one transaction; each of them enters its part.

    `pulses` is what a stuck bus needs to come free, `forced` holds (register, value), `flipped`
    holds (index among the bytes read, mask).
    """

    errno: int | None = None
    pulses: int = 0
    address_refused: bool = False
    refused_byte: int | None = None
    browned_out: list[Target] = field(default_factory=list)
    absent: list[Target] = field(default_factory=list)
    forced: list[tuple[int, int]] = field(default_factory=list)
    flipped: list[tuple[int, int]] = field(default_factory=list)

    def cut(self, messages: tuple[Message, ...]) -> tuple[Message, ...]:
        """Return the messages up to the refused byte, without it."""
        if self.refused_byte is None:
            return messages
        left = self.refused_byte
        for index, message in enumerate(messages):
            if isinstance(message, bytes):
                if left < len(message):
                    return (*messages[:index], message[:left])
                left -= len(message)
        return messages

    def tampered(self, messages: Sequence[Message], answer: bytes) -> bytes:
        """Return the bytes read with forced values put in, then bits flipped."""
        altered = bytearray(answer)
        for register, value in self.forced:
            altered[register - burst_start(messages)] = value
        for index, mask in self.flipped:
            altered[index] ^= mask
        return bytes(altered)


def burst_start(messages: Sequence[Message]) -> int:
    """Return the register a one-byte pointer write and a read begin at, 256 if it is not that."""
    if len(messages) == 2 and isinstance(messages[1], int):
        pointer = messages[0]
        if isinstance(pointer, bytes) and len(pointer) == 1:
            return pointer[0]
    return 256
