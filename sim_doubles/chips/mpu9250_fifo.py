"""The MPU-9250's FIFO: 512 bytes, the oldest overwritten or the newest refused when full."""

from collections import deque

from sim_doubles.chips.mpu9250_registers import (
    ACCEL_XOUT_H,
    CONFIG,
    FIFO_COUNTH,
    FIFO_COUNTL,
    FIFO_EN,
    FIFO_ENABLE,
    FIFO_MODE,
    FIFO_OFLOW,
    GYRO_XOUT_H,
    INT_STATUS,
    TEMP_OUT_H,
)
from sim_doubles.chips.protocol_warnings import ProtocolWarnings

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
