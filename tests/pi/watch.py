"""What is sent on the buses, by QEMU's trace, and whether outputs were on that should not be.

The checks say in between, by a byte of their own on another bus, from when on outputs may be on and
from when on none may. What is sent meanwhile that turns one on, or is to, is a failure.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final, NamedTuple

from tests.pi.computer import PWM

LED: Final = (*range(0x06, 0x46, 4), 0xFA)
"""First of the four registers of each output, and of all."""
OFF_H, FULL_OFF = 3, 0x10
"""The register that has it, and the bit that keeps an output off."""
_EVENT: Final = re.compile(rb"i2c_event (\w+)\(addr:0x(\w+)\)")
_BYTE: Final = re.compile(rb"i2c_send\w* send\(addr:0x(\w+)\) data:0x(\w+)")


class Sent(NamedTuple):
    """A message that was sent to a chip: a pointer, and the bytes from that register on."""

    address: int
    message: bytes

    def __str__(self) -> str:
        """Return it for people: `40 < fd 10`."""
        return f"{self.address:02x} < {self.message.hex(' ')}"


class Trace:
    """Messages in QEMU's trace, which comes in pieces."""

    def __init__(self) -> None:
        self._rest = b""
        self._open: dict[int, bytearray] = {}

    def messages(self, piece: bytes) -> Iterator[Sent]:
        """Yield what has been sent to a register; a pointer alone, as before a read, is none."""
        *lines, self._rest = (self._rest + piece).split(b"\n")
        for line in lines:
            if found := _BYTE.search(line):
                self._open.setdefault(int(found[1], 16), bytearray()).append(int(found[2], 16))
            elif found := _EVENT.search(line):
                address = int(found[2], 16)
                content = self._open.pop(address, b"")
                if len(content) > 1:
                    yield Sent(address, bytes(content))


class Watch:
    """What the messages of a boot did to outputs."""

    def __init__(self) -> None:
        self.may_drive = False
        self.faults: list[str] = []
        self._messages = {True: 0, False: 0}
        self._outputs: Mapping[str, int] = {}

    def take(self, sent: Sent, outputs: Mapping[str, int]) -> None:
        """Take a message, and how many outputs of each chip are on after it."""
        self._messages[self.may_drive] += 1
        self._outputs = outputs
        if self.may_drive:
            return
        if any(outputs.values()):
            self.faults.append(f"{sent}: on are {dict(outputs)}")
        elif sent.address == PWM and _is_to_turn_on(sent.message):
            self.faults.append(f"{sent}: not full-off")

    @property
    def is_off(self) -> bool:
        """Whether no output is on."""
        return not any(self._outputs.values())

    def line(self) -> str:
        """Return how it went, as a line of the guest."""
        what = "no message turned an output on while none might be"
        off, on = self._messages[False], self._messages[True]
        if self.faults or not off or not self.is_off:
            said = "; ".join(self.faults[:5]) or f"at the end on are {dict(self._outputs)}"
            return f"FAILED {what}: {said} ({len(self.faults)} of {off} messages)"
        return f"ok {what} ({off} messages then, {on} while driven; at the end all are off)"


def _is_to_turn_on(message: bytes) -> bool:
    """Return whether a message leaves an output without its full-off bit."""
    written: Iterable[tuple[int, int]] = enumerate(message[1:], message[0])
    return any(each - OFF_H in LED and not byte & FULL_OFF for each, byte in written)
