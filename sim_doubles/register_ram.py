"""Doubles behind register RAM: what makes a chip of a memory that answers on an emulator's I2C bus.

QEMU's Raspberry Pi has the real controllers and none of our chips, but memories that take a pointer
and bytes as our chips do. A `Puppet` keeps such a memory as a double's registers are: what the host
has written goes to the double, and what the double makes of it or measures goes into the memory.

It looks now and then, so it is late: a bit that a chip clears at once stays for a moment, and of
two values that the host writes to a register in between it sees the last. A memory has no errors,
no register that reading changes, and takes every write: a status that reading clears stays set, a
FIFO does not advance, an undefined register is kept.
"""

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Final, Protocol

from firmware_runtime.hal.i2c import I2cBus

SIZE: Final = 256
"""Registers of such a memory."""


class Shown(Protocol):
    """A double whose registers can be looked at without reading one."""

    address: int

    @property
    def content(self) -> bytes:
        """Return what stands in its registers, from the first on."""


class Puppet:
    """Keeps memories on one bus as the doubles at the same addresses of another are.

    The doubles' clock stands still while it looks: whoever calls `step` sets it on before. What
    stands in the memories before the first look is overwritten. Raises HalError where one is
    missing.
    """

    def __init__(self, memories: I2cBus, doubles: I2cBus, chips: Iterable[Shown]) -> None:
        self._memories = memories
        self._doubles = doubles
        self._shown = {chip.address: (chip, _padded(chip.content)) for chip in chips}
        for chip, content in self._shown.values():
            self._show(chip.address, content, range(SIZE))

    def step(self) -> None:
        """Look at each memory once, and bring both in line. Raises HalError."""
        for address, (chip, shown) in self._shown.items():
            found = self._memories.write_read(address, b"\0", SIZE)
            for run in _runs(_differing(found, shown)):
                self._doubles.write(address, bytes((run.start, *found[run.start : run.stop])))
            content = _padded(chip.content)
            self._show(address, content, _differing(content, found))
            self._shown[address] = chip, content

    def _show(self, address: int, content: bytes, registers: Iterable[int]) -> None:
        for run in _runs(registers):
            self._memories.write(address, bytes((run.start, *content[run.start : run.stop])))


def _padded(content: bytes) -> bytes:
    return content.ljust(SIZE, b"\0")


def _differing(one: bytes, other: bytes) -> list[int]:
    return [index for index, (a, b) in enumerate(zip(one, other, strict=True)) if a != b]


def _runs(registers: Iterable[int]) -> Iterator[range]:
    """Yield registers in a row as one range."""
    for _, group in groupby(enumerate(registers), lambda each: each[1] - each[0]):
        row = [register for _, register in group]
        yield range(row[0], row[-1] + 1)
