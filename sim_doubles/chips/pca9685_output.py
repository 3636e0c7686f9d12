"""The PCA9685's outputs: which counts they follow, and how long they are high.

Source: NXP PCA9685 data sheet rev. 4, 7.3.3 (counts and flags), 7.4 (OE and output drivers).
"""

from itertools import starmap
from operator import eq
from struct import Struct

from sim_doubles.chips.pca9685_registers import (
    CHANNELS,
    FULL,
    INVRT,
    LED0_ON_L,
    LED15_OFF_H,
    OUTDRV,
    OUTNE,
)
from sim_doubles.chips.protocol_warnings import ProtocolWarnings

STEPS = 4096
ALL_LOW = (0.0,) * CHANNELS
COUNTS = Struct("<HH")  # LEDn_ON and LEDn_OFF


class OutputLatch:
    """The counts the outputs follow, loaded from the LED registers."""

    def __init__(self, registers: bytearray, warnings: ProtocolWarnings) -> None:
        self._registers = registers
        self._warnings = warnings
        self.clear()

    def clear(self) -> None:
        """Take all channels to full-off."""
        self._counts: list[tuple[int, ...]] = [(0, FULL)] * CHANNELS
        self._shares = [0.0] * CHANNELS
        self._parts = [0] * CHANNELS
        self._first_written, self._last_written = LED15_OFF_H, LED0_ON_L

    @property
    def all_full_off(self) -> bool:
        """Return whether every channel has its full-off flag: then sleep interrupts nothing."""
        return all(off & FULL for _, off in self._counts)

    def note_written(self, first: int, last: int) -> None:
        """Take in which LED registers were written: the others need not be loaded."""
        if first < self._first_written:
            self._first_written = first
        if last > self._last_written:
            self._last_written = last

    def load_written(self) -> None:
        """Follow the LED registers as they stand: what STOP does with OCH = 0."""
        first = (self._first_written - LED0_ON_L) // 4
        end = (self._last_written - LED0_ON_L) // 4 + 1
        self._first_written, self._last_written = LED15_OFF_H, LED0_ON_L
        led_registers = self._registers[LED0_ON_L + 4 * first : LED0_ON_L + 4 * end]
        self._follow(first, list(COUNTS.iter_unpack(led_registers)))

    def load_on_acknowledge(self, register: int) -> bool:
        """Count one LED register in (OCH = 1); True if it was its channel's fourth, now loaded."""
        channel, part = divmod(register - LED0_ON_L, 4)
        self._parts[channel] |= 1 << part
        if self._parts[channel] != 0b1111:
            return False
        self._parts[channel] = 0
        self._follow(channel, [COUNTS.unpack_from(self._registers, LED0_ON_L + 4 * channel)])
        return True

    def duties(self, mode2: int) -> tuple[float, ...]:
        """Return the fraction of time each load sees high, outputs enabled.

        An open drain never drives high and is taken as low: a gate has a pull-down.
        """
        if not mode2 & OUTDRV:
            return ALL_LOW
        return tuple([1.0 - share for share in self._shares] if mode2 & INVRT else self._shares)

    def _follow(self, first: int, counts: list[tuple[int, ...]]) -> None:
        """Take over the counts of neighbouring channels, and the shares of a cycle they make."""
        end = first + len(counts)
        if counts != self._counts[first:end]:
            if any(starmap(eq, counts)):
                self._warn(first, counts)
            self._counts[first:end] = counts
            self._shares[first:end] = [  # full-off wins over full-on
                0.0 if off & FULL else 1.0 if on & FULL else (off - on) % STEPS / STEPS
                for on, off in counts
            ]

    def _warn(self, first: int, counts: list[tuple[int, ...]]) -> None:
        for channel, (on, off) in enumerate(counts, first):
            if on == off < FULL and self._counts[channel] != (on, off):
                self._warnings.note(
                    f"channel {channel} has ON == OFF == {on}, which the data sheet forbids; "
                    "silicon was seen to give 0 %"
                )


def disabled_duties(mode2: int) -> tuple[float, ...]:
    """Return what the loads see with OE high: OUTNE decides, a released output is low."""
    high = mode2 & OUTNE == 1 and mode2 & OUTDRV
    return (1.0,) * CHANNELS if high else ALL_LOW
