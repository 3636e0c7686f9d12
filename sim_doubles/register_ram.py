"""Doubles behind register RAM: what makes a chip of a memory that answers on an emulator's I2C bus.

QEMU's Raspberry Pi has the real controllers and none of our chips, but memories that take a pointer
and bytes as our chips do, and a trace of what is sent to them. A `Puppet` follows that: a double
takes all of it, in order, and what the double makes of it or measures is written into the memory.

It is late by the time that takes: a bit that a chip clears at once stays for a moment, and so does
a value that was on its way when the host wrote another there. A memory has no errors, no register
that reading changes, and takes every write: a status that reading clears stays set, a FIFO does not
advance, an undefined register is kept. It always answers, so a chip that is silent for a while, as
an SRF08 that ranges, cannot be made of it.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from typing import Final, Protocol, runtime_checkable

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.clock import Now

SIZE: Final = 256
"""Registers of such a memory."""
GAP: Final = 8
"""Registers between two that differ which are written along: one message takes less time."""
LOST_AFTER: Final = 5 * SECOND
"""Age at which a message of the puppet's own that was not seen to be sent is not waited for."""


@runtime_checkable
class Shown(Protocol):
    """A double whose registers can be looked at without reading one."""

    address: int

    @property
    def content(self) -> bytes:
        """Return what stands in its registers, from the first on."""

    def power_cycle(self) -> None:
        """Lose supply and get it back."""


class _Memory:
    """A memory as it stands, by what was sent to it, and what of that is still on its way."""

    def __init__(self, chip: Shown) -> None:
        self.chip = chip
        self.content = bytearray(SIZE)
        self.on_its_way: deque[bytes] = deque()
        self.given_up: deque[bytes] = deque(maxlen=SIZE)
        self.arrived: bytes | None = None
        self.since = 0

    def is_own(self, message: bytes) -> bool:
        """Return whether a message that was sent is the puppet's own; it is on its way no more."""
        if message == self.arrived:
            return True
        for waiting in (self.on_its_way, self.given_up):
            if message in waiting:
                while waiting.popleft() != message:
                    pass  # they come in order, so those before it were lost
                self.arrived = message
                return True
        self.arrived = None
        return False

    def keep(self, message: bytes) -> None:
        for register, byte in enumerate(message[1:], message[0]):
            self.content[register % SIZE] = byte


class Puppet:
    """Keeps memories as the doubles at the same addresses of a bus are.

    `write` is called with an address and a message that is to be written there, which must come
    back as any other that is sent. It is called for all registers at once, and then by `step`.
    """

    def __init__(
        self,
        doubles: I2cBus,
        chips: Iterable[Shown],
        now: Now,
        write: Callable[[int, bytes], None],
    ) -> None:
        self._doubles = doubles
        self._now = now
        self._write = write
        self._memories = {chip.address: _Memory(chip) for chip in chips}
        for address, memory in self._memories.items():
            self._send(address, memory, bytes((0, *_content(memory.chip))))

    def sent(self, address: int, message: bytes) -> bool:
        """Take a message that was sent, a pointer and bytes; return whether the host sent it.

        One of the puppet's own may come twice, where its sender was not told that it had arrived.
        """
        memory = self._memories.get(address)
        if memory is None:
            return True
        memory.keep(message)
        if memory.is_own(message):
            return False
        with suppress(NoAcknowledge):  # a register that the chip has not
            self._doubles.write(address, message)
        return True

    def step(self) -> None:
        """Write what has changed in the doubles, where nothing is on its way yet."""
        for address, memory in self._memories.items():
            if memory.on_its_way and self._now() - memory.since < LOST_AFTER:
                continue
            memory.given_up.extend(memory.on_its_way)
            memory.on_its_way.clear()
            content = _content(memory.chip)
            for run in _runs(_differing(content, bytes(memory.content))):
                self._send(address, memory, bytes((run.start, *content[run.start : run.stop])))

    def power_cycle(self, address: int) -> None:
        """A chip has lost its supply and got it back: its memory is empty."""
        memory = self._memories[address]
        memory.given_up.extend(memory.on_its_way)
        memory.on_its_way.clear()
        memory.content = bytearray(SIZE)
        memory.chip.power_cycle()
        self._send(address, memory, bytes((0, *_content(memory.chip))))

    def _send(self, address: int, memory: _Memory, message: bytes) -> None:
        memory.on_its_way.append(message)
        memory.since = self._now()
        self._write(address, message)


def _content(chip: Shown) -> bytes:
    return chip.content.ljust(SIZE, b"\0")


def _differing(one: bytes, other: bytes) -> Iterator[int]:
    return (index for index, (a, b) in enumerate(zip(one, other, strict=True)) if a != b)


def _runs(registers: Iterable[int]) -> Iterator[range]:
    """Yield registers that are near one another as one range."""
    first = last = -1
    for register in registers:
        if last < 0:
            first = register
        elif register - last > GAP:
            yield range(first, last + 1)
            first = register
        last = register
    if last >= 0:
        yield range(first, last + 1)
