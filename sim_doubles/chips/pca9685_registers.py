"""The PCA9685's register map: numbers, power-up values, writable bits, auto-increment order.

And what MODE1 reads after a write: the rules of SLEEP, RESTART and EXTCLK.
Source: NXP PCA9685 data sheet rev. 4, register summary, 7.3 and 7.3.1.
"""

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
