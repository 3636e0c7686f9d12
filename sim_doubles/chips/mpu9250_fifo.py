"""The MPU-9250's FIFO: 512 bytes, the oldest overwritten or the newest refused when full."""

from collections import deque

from sim_doubles.chips.mpu9250_registers import ACCEL_XOUT_H, FIFO_EN, GYRO_XOUT_H, TEMP_OUT_H

SIZE = 512

# Bit of FIFO_EN, first register, bytes: in the order in which a sample enters the FIFO.
BLOCKS = (
    (0x08, ACCEL_XOUT_H, 6),
    (0x80, TEMP_OUT_H, 2),
    (0x40, GYRO_XOUT_H, 2),
    (0x20, GYRO_XOUT_H + 2, 2),
    (0x10, GYRO_XOUT_H + 4, 2),
)


def enabled_blocks(registers: bytearray) -> bytes:
    """Return the bytes of the present sample that FIFO_EN selects, external ones excepted."""
    enabled = registers[FIFO_EN]
    return b"".join(
        registers[place : place + length] for bit, place, length in BLOCKS if enabled & bit
    )


class Fifo:
    """Bytes in the order they were sampled; what a full FIFO does is chosen with each packet."""

    def __init__(self) -> None:
        self._bytes: deque[int] = deque(maxlen=SIZE)
        self._last = 0

    def __len__(self) -> int:
        return len(self._bytes)

    def push(self, packet: bytes, *, stop_when_full: bool) -> bool:
        """Append a packet byte by byte; True when it did not fit."""
        room = SIZE - len(self._bytes)
        self._bytes.extend(packet[:room] if stop_when_full else packet)
        return len(packet) > room

    def pop(self) -> int:
        """Take the oldest byte; an empty FIFO repeats the last one."""
        if self._bytes:
            self._last = self._bytes.popleft()
        return self._last

    def clear(self) -> None:
        """Empty the FIFO."""
        self._bytes.clear()
