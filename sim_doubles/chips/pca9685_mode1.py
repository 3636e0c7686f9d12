"""What the PCA9685's MODE1 reads after a write: the rules of SLEEP, RESTART and EXTCLK.

Source: NXP PCA9685 data sheet rev. 4, 7.3.1.
"""

from firmware_runtime.devs.time import MICROSECOND
from sim_doubles.chips.pca9685_registers import EXTCLK, MODE1, RESTART, SLEEP, WRITABLE
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now

OSCILLATOR_START = 500 * MICROSECOND


class Mode1Rules:
    """The memory MODE1 needs beyond its bits: when the oscillator, started last, is stable."""

    def __init__(self, now: Now, warnings: ProtocolWarnings) -> None:
        self._now = now
        self._warnings = warnings
        self._stable_at = 0

    @property
    def starting(self) -> bool:
        """Whether the oscillator was started less than 500 us ago."""
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
        if old & SLEEP or self.starting:
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
