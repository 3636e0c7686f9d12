"""The MPU-9250's register map: numbers, bits, power-up values.

The FIFO holds 512 bytes, the oldest overwritten or the newest refused when full.

The sample clock: after a long silence not every tick needs work, only those that leave a trace a
host could read (`edges`). The first ones may fill a FIFO that stops when full, or carry out a
single auxiliary transaction; the last ones are what filters, an overwriting FIFO and EXT_SENS_DATA
still remember.

Source: InvenSense RM-MPU-9250A rev. 1.6. The factory values (self-test codes, accelerometer trim)
differ from chip to chip; these are plausible and not zero, as on any real one.
"""

from collections import deque
from collections.abc import Iterable
from itertools import chain

from msgspec import Struct

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from sim_doubles.chips.protocol_warnings import ProtocolWarnings

SELF_TEST_GYRO = 0x00
SELF_TEST_ACCEL = 0x0D
XG_OFFSET_H = 0x13
SMPLRT_DIV = 0x19
CONFIG = 0x1A
GYRO_CONFIG = 0x1B
ACCEL_CONFIG = 0x1C
ACCEL_CONFIG2 = 0x1D
FIFO_EN = 0x23
I2C_MST_CTRL = 0x24
I2C_SLV0_ADDR = 0x25  # ADDR, REG, CTRL of SLV0 to SLV3
I2C_SLV4_ADDR = 0x31  # ADDR, REG, DO, CTRL, DI
I2C_SLV4_CTRL = 0x34
I2C_SLV4_DI = 0x35
I2C_MST_STATUS = 0x36
INT_PIN_CFG = 0x37
INT_STATUS = 0x3A
ACCEL_XOUT_H = 0x3B
TEMP_OUT_H = 0x41
GYRO_XOUT_H = 0x43
EXT_SENS_DATA_00 = 0x49
I2C_SLV0_DO = 0x63
I2C_MST_DELAY_CTRL = 0x67
SIGNAL_PATH_RESET = 0x68
USER_CTRL = 0x6A
PWR_MGMT_1 = 0x6B
PWR_MGMT_2 = 0x6C
FIFO_COUNTH = 0x72
FIFO_COUNTL = 0x73
FIFO_R_W = 0x74
WHO_AM_I = 0x75
XA_OFFSET_H = 0x77

FIFO_MODE = 0x40  # CONFIG: stop when full
SLV3_FIFO = 0x20  # I2C_MST_CTRL
ANYRD_2CLEAR, BYPASS_EN = 0x10, 0x02  # INT_PIN_CFG
FIFO_OFLOW, RAW_DATA_RDY = 0x10, 0x01  # INT_STATUS
SLV4_DONE, SLV4_NACK = 0x40, 0x10  # I2C_MST_STATUS
FIFO_ENABLE, I2C_MST_EN, I2C_IF_DIS = 0x40, 0x20, 0x10  # USER_CTRL
FIFO_RST, I2C_MST_RST, SIG_COND_RST = 0x04, 0x02, 0x01
H_RESET, SLEEP, CYCLE, GYRO_STANDBY, PD_PTAT, CLKSEL = (
    0x80,
    0x40,
    0x20,
    0x10,
    0x08,
    0x07,
)  # PWR_MGMT_1
CLOCK_STOPPED = 7  # CLKSEL

EXTERNAL_BYTES = 24  # EXT_SENS_DATA_00 to 23

GYRO_SELF_TEST_CODES = (0x97, 0x9A, 0x94)
ACCEL_SELF_TEST_CODES = (0x64, 0x66, 0x61)
ACCEL_TRIM = (0x1B39, 0xEA85, 0x20F7)  # offset words; bit 0 is the factory's

READ_ONLY = frozenset(
    {I2C_SLV4_DI, I2C_MST_STATUS, *range(INT_STATUS, 0x61), FIFO_COUNTH, FIFO_COUNTL, WHO_AM_I}
)


def power_up(who_am_i: int) -> bytes:
    """Return all registers as they are after power-up or H_RESET."""
    registers = bytearray(128)
    registers[SELF_TEST_GYRO : SELF_TEST_GYRO + 3] = bytes(GYRO_SELF_TEST_CODES)
    registers[SELF_TEST_ACCEL : SELF_TEST_ACCEL + 3] = bytes(ACCEL_SELF_TEST_CODES)
    registers[PWR_MGMT_1] = 0x01
    registers[WHO_AM_I] = who_am_i
    for axis, word in enumerate(ACCEL_TRIM):
        place = XA_OFFSET_H + 3 * axis
        registers[place : place + 2] = word.to_bytes(2, "big")
    return bytes(registers)


def signed_word(registers: bytearray, high: int) -> int:
    """Return the signed 16-bit word whose high byte is at `high`."""
    return int.from_bytes(registers[high : high + 2], "big", signed=True)


SIZE = 512

# Bit of FIFO_EN, first register, bytes: in the order in which a sample enters the FIFO.
BLOCKS = (
    (0x08, ACCEL_XOUT_H, 6),
    (0x80, TEMP_OUT_H, 2),
    (0x40, GYRO_XOUT_H, 2),
    (0x20, GYRO_XOUT_H + 2, 2),
    (0x10, GYRO_XOUT_H + 4, 2),
)


class Fifo:
    """Bytes in the order they were sampled; the registers say which, and what it does when full."""

    def __init__(self, registers: bytearray, warnings: ProtocolWarnings) -> None:
        self._registers = registers
        self._warnings = warnings
        self._bytes: deque[int] = deque(maxlen=SIZE)
        self._last = 0

    def push_sample(self, external: bytes) -> None:
        """Append what FIFO_EN selects of the data registers, then the auxiliary bus's bytes."""
        registers = self._registers
        enabled = registers[FIFO_EN]
        blocks = (
            registers[place : place + length] for bit, place, length in BLOCKS if enabled & bit
        )
        self.push(b"".join(blocks) + external)

    def push(self, packet: bytes) -> None:
        """Append a packet byte by byte; one that did not fit sets the overflow flag."""
        room = SIZE - len(self._bytes)
        stops_when_full = self._registers[CONFIG] & FIFO_MODE
        self._bytes.extend(packet[:room] if stops_when_full else packet)
        if len(packet) > room:
            self._registers[INT_STATUS] |= FIFO_OFLOW

    def pop(self) -> int:
        """Take the oldest byte; an empty FIFO repeats the last one."""
        if self._bytes:
            self._last = self._bytes.popleft()
        return self._last

    def latch_count(self) -> int:
        """Put the number of bytes into its two registers; return the high one."""
        self._registers[FIFO_COUNTH : FIFO_COUNTL + 1] = len(self._bytes).to_bytes(2, "big")
        return self._registers[FIFO_COUNTH]

    def reset(self, user_control: int) -> None:
        """Do what FIFO_RST in a byte written to USER_CTRL does."""
        if user_control & FIFO_ENABLE:
            self._warnings.note("FIFO_RST written with FIFO_EN set; the real chip ignores it")
        else:
            self.clear()

    def clear(self) -> None:
        """Empty the FIFO."""
        self._bytes.clear()


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
    # One byte a tick fills the FIFO.
    return Edges(SIZE if stops_when_full else auxiliary, SIZE + memory)


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
