"""The PCA9685's register map: numbers, power-up values, writable bits, auto-increment order.

And what MODE1 reads after a write: the rules of SLEEP, RESTART and EXTCLK.

Its outputs: which counts they follow, and how long they are high.

Source: NXP PCA9685 data sheet rev. 4, 7.3.3 (counts and flags), 7.4 (OE and output drivers).

Source: NXP PCA9685 data sheet rev. 4, register summary, 7.3 and 7.3.1.
"""

from itertools import starmap
from operator import eq
from struct import Struct

from firmware_runtime.devs.time import MICROSECOND
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now

MODE1 = 0x00
MODE2 = 0x01
SUBADR1 = 0x02
ALLCALLADR = 0x05
LED0_ON_L = 0x06
LED15_OFF_H = 0x45
ALL_LED_ON_L = 0xFA
ALL_LED_OFF_H = 0xFD
PRE_SCALE = 0xFE

# MODE1
RESTART = 0x80
EXTCLK = 0x40
AI = 0x20
SLEEP = 0x10
ENABLES = (0x08, 0x04, 0x02, 0x01)  # SUB1, SUB2, SUB3, ALLCALL: in the order of their registers

# MODE2
INVRT = 0x10
OCH = 0x08
OUTDRV = 0x04
OUTNE = 0x03

FULL = 0x1000  # bit 4 of LEDn_ON_H and LEDn_OFF_H, in the 16-bit word
CHANNELS = 16
LEAST_PRE_SCALE = 3
SOFTWARE_RESET = 0x06

_LED_POWER_UP = (0x00, 0x00, 0x00, 0x10) * CHANNELS
_LED_WRITABLE = (0xFF, 0x1F, 0xFF, 0x1F) * CHANNELS

POWER_UP = bytes([0x11, 0x04, 0xE2, 0xE4, 0xE8, 0xE0, *_LED_POWER_UP, *[0] * 184, 0x1E, 0])
WRITABLE = bytes([0x3F, 0x1F, 0xFE, 0xFE, 0xFE, 0xFE, *_LED_WRITABLE])
NEXT = bytes([*range(1, 0x46), 0, *range(0x47, 0xFF), 0, 0])


def enabled_addresses(registers: bytearray) -> list[int]:
    """The sub-addresses and the all-call address that MODE1 enables."""
    return [
        registers[SUBADR1 + index] >> 1
        for index, enable in enumerate(ENABLES)
        if registers[MODE1] & enable
    ]


OSCILLATOR_START = 500 * MICROSECOND


class Mode1Rules:
    """The memory MODE1 needs beyond its bits: when the oscillator, started last, is stable."""

    def __init__(self, now: Now, warnings: ProtocolWarnings) -> None:
        self._now = now
        self._warnings = warnings
        self._stable_at = 0

    def is_starting(self) -> bool:
        """Return whether the oscillator was started less than 500 us ago."""
        return self._now() < self._stable_at

    def after(self, byte: int, old: int, *, interrupts: bool) -> int:
        """Return MODE1 after writing `byte` over `old`; `interrupts`: a channel is running now."""
        restart = self._restart(byte, old, interrupts=interrupts)
        new = byte & WRITABLE[MODE1] | restart | self._external_clock(byte, old)
        if old & SLEEP and not new & SLEEP:
            self._stable_at = self._now() + OSCILLATOR_START
        return new

    def _restart(self, byte: int, old: int, *, interrupts: bool) -> int:
        """Sleep sets RESTART when it interrupts a channel, writing 1 awake clears it."""
        pending = old & RESTART
        if byte & SLEEP:
            return RESTART if interrupts else pending
        if not (pending and byte & RESTART):
            return pending
        if old & SLEEP or self.is_starting():
            self._warnings.note("RESTART written within 500 us of waking; the real chip ignores it")
            return pending
        return 0

    def _external_clock(self, byte: int, old: int) -> int:
        """EXTCLK can be set asleep only, and no write clears it."""
        if old & EXTCLK:
            if not byte & EXTCLK:
                self._warnings.note("EXTCLK written 0; only a reset clears it on the real chip")
            return EXTCLK
        if byte & EXTCLK and not old & SLEEP:
            self._warnings.note("EXTCLK written awake; the real chip ignores it")
            return 0
        if byte & EXTCLK:
            self._warnings.note("EXTCLK set; the real chip keeps it until a reset")
        return byte & EXTCLK


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
