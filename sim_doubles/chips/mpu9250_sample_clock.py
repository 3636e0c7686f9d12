"""The MPU-9250's sample clock: at which instants a sample is taken, and which of them matter.

Source: InvenSense RM-MPU-9250A rev. 1.6, SMPLRT_DIV and CONFIG.

After a long silence not every tick needs work, only those that leave a trace a host could read
(`edges`). The first ones may fill a FIFO that stops when full, or carry out a single auxiliary
transaction; the last ones are what filters, an overwriting FIFO and EXT_SENS_DATA still remember.
"""

from collections.abc import Iterable
from itertools import chain

from msgspec import Struct

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from sim_doubles.chips.mpu9250_registers import (
    CLKSEL,
    CLOCK_STOPPED,
    CONFIG,
    FIFO_EN,
    FIFO_ENABLE,
    FIFO_MODE,
    GYRO_CONFIG,
    H_RESET,
    I2C_MST_EN,
    PWR_MGMT_1,
    SLEEP,
    SMPLRT_DIV,
    USER_CTRL,
)

FIFO_TICKS = 512
"""One byte each fills the FIFO."""
AUXILIARY_TICKS = 32
"""A delayed auxiliary slave has its turn once in so many."""


class Edges(Struct, frozen=True):
    """Ticks after the beginning and before the end of a silence that leave a trace."""

    first: int
    last: int


def edges(registers: bytearray, memory: int) -> Edges:
    """Return the ticks that matter; `memory` is how many back the filters still remember."""
    control = registers[USER_CTRL]
    auxiliary = AUXILIARY_TICKS if control & I2C_MST_EN else 0
    if not (control & FIFO_ENABLE and registers[FIFO_EN]):
        return Edges(auxiliary, auxiliary + memory)
    stops_when_full = registers[CONFIG] & FIFO_MODE
    return Edges(FIFO_TICKS if stops_when_full else auxiliary, FIFO_TICKS + memory)


def is_sampling(registers: bytearray) -> bool:
    """Return whether samples are taken: awake, clocked, and not in a reset."""
    power = registers[PWR_MGMT_1]
    return not power & (SLEEP | H_RESET) and power & CLKSEL != CLOCK_STOPPED


def sample_period(registers: bytearray) -> int:
    """Return the sample period in ns: 32 kHz, 8 kHz, or 1 kHz divided by SMPLRT_DIV + 1."""
    if registers[GYRO_CONFIG] & 0x03:
        return SECOND // 32_000
    if registers[CONFIG] & 0x07 in {0, 7}:
        return SECOND // 8_000
    return MILLISECOND * (registers[SMPLRT_DIV] + 1)


class SampleClock:
    """Ticks every `period` from the moment it was started or its period changed."""

    def __init__(self) -> None:
        self.next_at = NEVER
        self._period = 0
        self._started_at = 0

    def run(self, period: int, at: int) -> None:
        """Tick every `period` from `at` on; a clock that does so already is left alone."""
        if self.next_at == NEVER or period != self._period:
            self._period, self._started_at, self.next_at = period, at, at + period

    def stop(self) -> None:
        """Tick no more."""
        self.next_at = NEVER

    def number(self, at: int) -> int:
        """Return the number of the tick at `at`; the first is 1."""
        return (at - self._started_at) // self._period

    def take(self, now: int, matter: Edges) -> Iterable[int]:
        """Return the ticks up to `now`, which is one at least, that matter: in order, each once."""
        period, first = self._period, self.next_at
        if now < first + period and matter.last > 0:
            self.next_at += period
            return (first,)
        self.next_at += ((now - first) // period + 1) * period
        last_ones = max(first, self.next_at - matter.last * period)
        first_ones_end = min(first + matter.first * period, last_ones)
        return chain(range(first, first_ones_end, period), range(last_ones, self.next_at, period))
