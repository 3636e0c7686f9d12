"""Double of the NXP PCA9685, 16 x 12-bit PWM. Source: NXP data sheet rev. 4.

Modelled: all registers with their reset values, pointer and auto-increment, refused reserved
registers, sleep, RESTART, the sticky external clock, update on STOP or on acknowledge (OCH),
all-call and sub-addresses, software reset by general call, OE, INVRT, OUTDRV and OUTNE.

Not modelled: a new value takes effect at its STOP or acknowledge, not at the end of the running PWM
cycle; outputs run from the moment SLEEP is cleared, the oscillator's start-up only decides whether
a RESTART counts. Assumed where the data sheet is silent: outputs are low in sleep, also full-on
ones; the pointer is unchanged after a refused register; when an LED write withdraws a pending
RESTART, all channels run again with the values they hold.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.i2c import GENERAL_CALL
from sim_doubles.chips.pca9685_registers import (
    AI,
    ALL_LED_OFF_H,
    ALL_LED_ON_L,
    ALL_LOW,
    ALLCALLADR,
    EXTCLK,
    LEAST_PRE_SCALE,
    LED0_ON_L,
    LED15_OFF_H,
    MODE1,
    MODE2,
    NEXT,
    OCH,
    POWER_UP,
    PRE_SCALE,
    RESTART,
    SLEEP,
    SOFTWARE_RESET,
    STEPS,
    WRITABLE,
    Mode1Rules,
    OutputLatch,
    disabled_duties,
    enabled_addresses,
)
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target

if TYPE_CHECKING:
    from sim_doubles.outputs import BrokenOutputs

# What the next byte written is.
POINTER, CONTENT, CALL, REFUSED = range(4)


class Pca9685Double(Target):
    """A PCA9685 at `address`, with the true frequency of its oscillator.

    `external_clock_hz` is what stands at the EXTCLK pin; None is nothing, which stops every output
    once EXTCLK is set. World face: `duties`, `running`, `frequency_hz`, `output_enabled` (the OE
    pin); `before_change` is called just before any output changes, with the old duties still there.
    """

    def __init__(
        self,
        now: Now,
        address: int = 0x40,
        *,
        true_osc_hz: float = 25e6,
        external_clock_hz: float | None = None,
    ) -> None:
        if not 0x40 <= address <= 0x7F or address == 0x70:
            raise ValueError(
                f"PCA9685: address is 0x{address:02x}, expected 0x40 to 0x7f without 0x70"
            )
        self.address = address
        self.before_change: Callable[[], None] | None = None
        self.warnings = ProtocolWarnings(f"PCA9685 0x{address:02x}")
        self._true_osc_hz = true_osc_hz
        self._external_clock_hz = external_clock_hz
        self._output_enabled = True
        self.duties = ALL_LOW
        """Duty of each output: the fraction of time it is high; to be read only."""
        self._broken: BrokenOutputs | None = None
        self._registers = bytearray(256)
        self._pointer = 0
        self._next_is = REFUSED
        self._reset_asked = self._led_written = False
        self._mode1 = Mode1Rules(now, self.warnings)
        self._latch = OutputLatch(self._registers, self.warnings)
        self._reset()

    # World face

    def levels(self, at: int) -> dict[str, float]:  # noqa: ARG002 -- none changes by itself
        """The duty of each output, by its number."""
        return {str(channel): duty for channel, duty in enumerate(self.duties)}

    def next_change_at(self, at: int) -> int:  # noqa: ARG002 -- at no instant
        """Never: duties stay until the host writes."""
        return NEVER

    def duty(self, channel: int) -> float:
        """Return what the load sees of one output: the fraction of time it is high."""
        return self.duties[channel]

    @property
    def content(self) -> bytes:
        """Return what stands in its 256 registers."""
        return bytes(self._registers)

    @property
    def all_off(self) -> bool:
        """Return whether no output is ever high, for whatever reason."""
        return not any(self.duties)

    @property
    def running(self) -> bool:
        """Return whether the PWM runs: awake, clocked and not waiting for a RESTART."""
        return not self._registers[MODE1] & (SLEEP | RESTART) and self._clock_hz() > 0.0

    @property
    def frequency_hz(self) -> float:
        """The PWM frequency from the clock in use and PRE_SCALE; 0 without a clock."""
        return self._clock_hz() / (STEPS * (self._registers[PRE_SCALE] + 1))

    @property
    def output_enabled(self) -> bool:
        """Return whether the OE pin is low; high takes all outputs to the state that OUTNE sets."""
        return self._output_enabled

    @output_enabled.setter
    def output_enabled(self, enabled: bool) -> None:
        self._output_enabled = enabled
        self._update_outputs()

    def break_output(self, kind: str, number: int) -> None:
        """Break what stands behind one output, until `heal_outputs`."""
        from sim_doubles.outputs import BrokenOutputs  # noqa: PLC0415 -- of a run with faults

        if self._broken is None:
            self._broken = BrokenOutputs(full=1.0)
        self._broken.add(kind, number, self.duties)
        self._update_outputs()

    def heal_outputs(self) -> None:
        """Let all outputs follow the registers again."""
        self._broken = None
        self._update_outputs()

    def power_cycle(self) -> None:
        """Lose supply and get it back: asleep, all channels full-off."""
        self._reset()

    # Bus face

    def start(self, address: int, *, read: bool) -> bool:
        """Answer the hardware address, enabled sub-addresses, all-call and general call write."""
        self._reset_asked = False
        if address in self._addresses:
            self._next_is = POINTER
            return True
        self._next_is = CALL
        return address == GENERAL_CALL and not read

    def write(self, byte: int) -> bool:
        """Take the pointer, then register contents; refuse reserved registers."""
        if self._next_is != CONTENT:
            return self._take_first(byte)
        register = self._pointer
        if LED0_ON_L <= register <= LED15_OFF_H:
            self._registers[register] = byte & WRITABLE[register]
            self._note_led_write(register, register)
            if self._registers[MODE2] & OCH:
                self._load_on_acknowledge(register)
        else:
            self._write_register(register, byte)
        if self._registers[MODE1] & AI:
            self._pointer = NEXT[register]
        return True

    def write_bytes(self, message: bytes) -> int | None:
        """Take a message; one of LED registers that count up has nothing to look at byte by byte.

        That is so while they take effect on STOP: then they are masked and kept, all at once.
        """
        first = message[0] if message else LED15_OFF_H
        last = first + len(message) - 2
        if (
            self._next_is != POINTER
            or not LED0_ON_L <= first <= last <= LED15_OFF_H
            or not self._registers[MODE1] & AI
            or self._registers[MODE2] & OCH
        ):
            return super().write_bytes(message)
        end = last + 1
        content = int.from_bytes(message[1:]) & int.from_bytes(WRITABLE[first:end])
        self._registers[first:end] = content.to_bytes(end - first)
        self._note_led_write(first, last)
        self._pointer = NEXT[last]
        self._next_is = CONTENT
        return None

    def read(self) -> int:
        """Give the register at the pointer; ALL_LED and the test register read 0."""
        register = self._pointer
        if self._registers[MODE1] & AI:
            self._pointer = NEXT[register]
        return self._registers[register]

    def stop(self) -> None:
        """Carry out what waits for STOP: a software reset, or new outputs (OCH = 0)."""
        if self._led_written:
            self._led_written = False
            self._finish_led_write()
        if self._reset_asked:
            self._reset()

    def _take_first(self, byte: int) -> bool:
        """Take a byte that is no register content: a pointer, or what follows a general call."""
        if self._next_is == POINTER:
            return self._set_pointer(byte)
        self._reset_asked = self._next_is == CALL and byte == SOFTWARE_RESET
        self._next_is = REFUSED
        return self._reset_asked

    def _set_pointer(self, byte: int) -> bool:
        if LED15_OFF_H < byte < ALL_LED_ON_L:
            self.warnings.note(f"reserved register 0x{byte:02x} is not acknowledged")
            self._next_is = REFUSED
            return False
        self._pointer = byte
        self._next_is = CONTENT
        return True

    # Registers

    def _reset(self) -> None:
        self._registers[:] = POWER_UP
        self._latch.clear()
        self._pointer = 0
        self._next_is = REFUSED
        self._reset_asked = self._led_written = False
        self._find_addresses()
        self._update_outputs()

    def _write_register(self, register: int, byte: int) -> None:
        if register == MODE1:
            self._write_mode1(byte)
        elif register == MODE2:
            self._registers[MODE2] = byte & WRITABLE[MODE2]
            self._update_outputs()
        elif register <= ALLCALLADR:
            self._registers[register] = byte & WRITABLE[register]
            self._find_addresses()
        elif register <= ALL_LED_OFF_H:
            self._write_all_led(register, byte)
        elif register == PRE_SCALE:
            self._write_pre_scale(byte)
        else:
            self.warnings.note("TestMode written; the effect on the real chip is undefined")

    def _write_all_led(self, register: int, byte: int) -> None:
        self._note_led_write(LED0_ON_L, LED15_OFF_H)
        first = register - ALL_LED_ON_L + LED0_ON_L
        for copy in range(first, LED15_OFF_H + 1, 4):
            self._registers[copy] = byte & WRITABLE[copy]
            if self._registers[MODE2] & OCH:
                self._load_on_acknowledge(copy)

    def _write_pre_scale(self, byte: int) -> None:
        if self._registers[MODE1] & SLEEP:
            self._registers[PRE_SCALE] = max(byte, LEAST_PRE_SCALE)
        else:
            self.warnings.note("PRE_SCALE written awake; the real chip ignores it")

    def _write_mode1(self, byte: int) -> None:
        interrupts = self.running and not self._latch.all_full_off
        old = self._registers[MODE1]
        self._registers[MODE1] = self._mode1.after(byte, old, interrupts=interrupts)
        self._find_addresses()
        self._update_outputs()

    def _find_addresses(self) -> None:
        self._addresses = frozenset((self.address, *enabled_addresses(self._registers)))

    # Outputs

    def _note_led_write(self, first: int, last: int) -> None:
        self._led_written = True
        self._latch.note_written(first, last)

    def _clock_hz(self) -> float:
        if self._registers[MODE1] & EXTCLK:
            return self._external_clock_hz or 0.0
        return self._true_osc_hz

    def _load_on_acknowledge(self, register: int) -> None:
        if self._latch.load_on_acknowledge(register):
            self._withdraw_restart()

    def _finish_led_write(self) -> None:
        if self._mode1.is_starting() and not self._registers[MODE1] & SLEEP:
            self.warnings.note("LED registers written within 500 us of waking; timing is undefined")
        if not self._registers[MODE2] & OCH:
            self._latch.load_written()
            self._withdraw_restart()

    def _withdraw_restart(self) -> None:
        """Clear a pending RESTART, which new counts make pointless; outputs run."""
        self._registers[MODE1] &= ~RESTART
        self._update_outputs()

    def _update_outputs(self) -> None:
        duties = self._outputs()
        if self._broken is not None:
            duties = self._broken.applied(duties)
        if duties != self.duties:
            if self.before_change is not None:
                self.before_change()
            self.duties = duties

    def _outputs(self) -> tuple[float, ...]:
        mode2 = self._registers[MODE2]
        if not self._output_enabled:
            return disabled_duties(mode2)
        return self._latch.duties(mode2) if self.running else ALL_LOW
