"""Parts that answer where a chip is expected and are none.

Each takes what is written as a chip takes it: a register's number, then bytes, and counts on.
"""

from collections.abc import Mapping

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now


class RegisterRam(RegisterTarget):
    """Keeps every byte that is written, and reads it; what it holds at first is stated."""

    def __init__(self, now: Now, address: int, holds: Mapping[int, int]) -> None:
        super().__init__(now, address)
        self.memory = bytearray(256)
        for register, byte in holds.items():
            self.memory[register] = byte

    def _read_register(self, register: int) -> int:
        return self.memory[register]

    def _write_register(self, register: int, byte: int) -> None:
        self.memory[register] = byte


class ReadOnly(RegisterRam):
    """Acknowledges what is written and forgets it."""

    def _write_register(self, register: int, byte: int) -> None:
        """Keep what there is."""


class BusyRam(RegisterRam):
    """Is silent for `busy` ns after a write to one of the registers `busy_after`."""

    busy = 20 * MILLISECOND
    busy_after = range(1)
    _silent_until = 0

    def _listens_to(self, address: int, *, read: bool) -> bool:
        return super()._listens_to(address, read=read) and self._now() >= self._silent_until

    def _write_register(self, register: int, byte: int) -> None:
        super()._write_register(register, byte)
        if register in self.busy_after:
            self._silent_until = self._now() + self.busy


class Eeprom(BusyRam):
    """Is silent while it stores what was written (AT24C, 24AA: 5 ms at most)."""

    busy = 5 * MILLISECOND
    busy_after = range(256)
