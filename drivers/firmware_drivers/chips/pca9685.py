"""NXP PCA9685, 16 PWM outputs of 12 bits with one common frequency (data sheet rev. 4).

The driver turns duties into one burst, brings the chip up from any state with its outputs off, and
stops all outputs with six bytes. It answers for coherent updates (OCH = 0: the outputs of a burst
change together, at the end of the PWM cycle in which its STOP came), for the rate and for leaving
the ALLCALL address 0x70 to others.

It is not responsible for what happens when it is not called: the chip has no watchdog and keeps
the last duties. The OE pin, external clock and sub-addresses are not used. A chip whose
external clock was latched on (EXTCLK) is refused: nothing but a reset clears it.
"""

import math
from collections.abc import Iterable, Sequence
from functools import partial
from itertools import count
from typing import Final

from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.pca9685_registers import (
    BURSTS,
    CHANNELS,
    COUNTS,
    FULL,
    FULL_OFF,
    FULL_ON,
    LED0_ON_L,
    NOMINAL_OSC_HZ,
    actual_frequency_hz,
    prescale_for,
)
from firmware_drivers.chips.shared_bring_up import SharedBringUp, Turn, nothing
from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import GENERAL_CALL, I2cBus, Message

MODE1: Final = 0x00
MODE2: Final = 0x01
ALL_LED_OFF_H: Final = 0xFD
PRE_SCALE: Final = 0xFE

RESTART: Final = 0x80
EXTCLK: Final = 0x40
AI: Final = 0x20
SLEEP: Final = 0x10
INVRT: Final = 0x10
OCH: Final = 0x08
OUTDRV: Final = 0x04
SWRST: Final = 0x06

OSCILLATOR_START_NS: Final = 500_000
LONGEST_CYCLE_NS: Final = 46_200_000
"""One PWM cycle at 23.84 Hz, the slowest rate, of an oscillator that is a tenth slow."""

POLL: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((MODE1,)), 2),
    (bytes((PRE_SCALE,)), 1),
)
"""Transactions of `poll`, for the bus-time budget."""

_MODES: Final = bytes((AI, OUTDRV))


def software_reset(bus: I2cBus) -> None:
    """Bring every PCA9685 of the bus to its power-up state: asleep, all outputs off.

    The only cure for a latched EXTCLK short of power. A general call: other chips may listen too.
    """
    bus.write(GENERAL_CALL, bytes((SWRST,)))


class OutputUsers:
    """The models and bridges that drive outputs of the chip at `place`, by name."""

    def __init__(self, place: str) -> None:
        self._place = place
        self._names: list[str] = []
        self._stops_all: str | None = None

    def add(self, name: str, *, stops_all: bool = False) -> None:
        """Let one more drive outputs; `stops_all`: it turns all of the chip's off when it stops.

        Raises SettingError where one of two would be switched off by the other, unnoticed.
        """
        alone = name if stops_all else self._stops_all
        if alone is not None and self._names:
            other = self._names[0] if stops_all else name
            raise SettingError(
                f"{alone} turns all outputs off when it stops, and {other} drives some of them",
                where=self._place,
                expected=f"a chip of its own for {alone}",
            )
        self._names.append(name)
        self._stops_all = alone


class Pca9685(I2cChip):
    """One PCA9685. `frequency_hz` is the true PWM frequency by `osc_hz`, 0 before it runs.

    Duties are shares of a cycle, 0 to 1. `osc_hz` is the oscillator as measured on this board (the
    part is good to some 5 %). `staggered` switches channel n on at count 256 n instead of 0, which
    spreads inrush and changes neither bytes nor duties; but pulses then straddle the cycle's end,
    so one pulse may mix old and new duty when they change.
    """

    chip = "PCA9685"
    addresses = range(0x40, 0x80)

    def __init__(
        self,
        bus: I2cBus,
        address: int = 0x40,
        *,
        osc_hz: float = NOMINAL_OSC_HZ,
        staggered: bool = False,
    ) -> None:
        super().__init__(bus, address)
        self.frequency_hz = 0.0
        self.osc_hz = osc_hz
        self._on_step = COUNTS // CHANNELS if staggered else 0
        self._prescale = 0
        self.is_running = False
        """True if it was brought up and has not been found reset since: only then it takes duties.
        """
        self._turn = Turn()
        self.users = OutputUsers(self.place)

    # Bring-up -----------------------------------------------------------------------------------

    def bring_up(self, frequency_hz: float) -> tuple[Step, ...]:
        """Give the steps from any state to running at that rate with all outputs off.

        The first only waits: a robot's probe may have woken the chip by `silence` just before.
        `silence` must come before any traffic to other chips of this bus: until then 0x70 is this
        one too. A chip left running stops at the end of its PWM cycle, not in a pulse.
        Raises SettingError at once; the steps raise NoAcknowledge, WrongDevice or NotReady.
        """
        prescale = prescale_for(frequency_hz, self.osc_hz)
        return (
            Step("let the oscillator start", nothing, OSCILLATOR_START_NS),
            Step("silence", self.silence, LONGEST_CYCLE_NS),
            Step("identify", self.identify, 0),
            Step("sleep", partial(self._write, MODE1, AI | SLEEP), 0),
            Step("set rate", partial(self._set_rate, prescale), 0),
            Step("wake", partial(self._write, MODE1, AI), OSCILLATOR_START_NS),
            Step("verify", self.verify, 0),
        )

    def share_bring_up(self, frequency_hz: float) -> SharedBringUp:
        """Give the steps for one of several models that drive outputs of this chip.

        The first takes the steps of `bring_up`; the others wait until they are done. A chip that
        runs is verified and nothing else, so that the outputs of the others stay as they are.
        Raises SettingError at its first step if the chip runs at another rate.
        """
        return SharedBringUp(
            self._turn,
            lambda: self.is_running,
            partial(self.bring_up, frequency_hz),
            lambda: (Step("verify", partial(self._verify_at, frequency_hz), 0),),
        )

    def _verify_at(self, frequency_hz: float) -> None:
        if prescale_for(frequency_hz, self.osc_hz) != self._prescale:
            raise SettingError(
                f"runs at {self.frequency_hz:.1f} Hz, and {frequency_hz} Hz is wanted as well",
                where=self.place,
                expected="one rate for all its outputs",
            )
        self.verify()

    def silence(self) -> None:
        """Turn all outputs off and leave the ALLCALL address; 87 bits.

        Off comes first: a sleeping chip wakes by the last write, and must have nothing to run.
        Raises NoAcknowledge if nothing answers.
        """
        self.is_running = False
        with self._must_answer("a PCA9685"):
            self.stop_all()
            self._write(MODE1, AI)

    def identify(self) -> None:
        """Check that this can be a PCA9685 at all: it has no identity register.

        After `silence`, MODE1 must read as written, MODE2 and the four address registers must have
        their fixed zeros, and full-off must have gone from ALL_LED_OFF_H to an output, which no
        memory does. Raises WrongDevice, or NotReady if EXTCLK is latched.
        """
        found = self._read(MODE1, 6)
        mode1, mode2, *addresses = found
        fixed_zeros = mode2 & 0xE0 == 0 and not any(address & 1 for address in addresses)
        if mode1 & ~(RESTART | EXTCLK) != AI or not fixed_zeros:
            raise self._wrong_device(
                f"registers 0 to 5 read {found.hex(' ')}, expected MODE1 20, MODE2 "
                "below 20 and four even address registers; another device answers "
                "here"
            )
        off = self._read(LED0_ON_L + 3)[0]
        if not off & FULL:
            raise self._wrong_device(
                f"not a PCA9685: LED0_OFF_H reads {off:02x} after full-off was written "
                "to all outputs at once",
                "10",
            )
        if mode1 & EXTCLK:
            raise self._not_ready(
                f"MODE1 reads {mode1:02x}, EXTCLK is latched and no PWM can run",
                "20; switch its power off and on, or send a software reset",
            )

    def verify(self) -> None:
        """Check that the chip is as it was to be brought up, and let it take duties; see `poll`."""
        self.poll()
        self.is_running = True

    def poll(self) -> None:
        """Check that it was neither reset nor written to by another program; two transactions.

        They are 88 bits. After a brown-out it is asleep with all outputs off, takes a burst of
        duties into one register, and reads MODE1 twice: it does not count registers up. At another
        rate every pulse is of another width. Raises NotReady if MODE1, MODE2 and PRE_SCALE are not
        as set; duties are refused until it is brought up again.
        """
        found = self._read(MODE1, 2) + self._read(PRE_SCALE)
        expected = _MODES + bytes((self._prescale,))
        if found != expected:
            self.is_running = False
            what = f"MODE1, MODE2, PRE_SCALE read {found.hex(' ')}"
            raise self._was_changed(what, expected.hex(" "))

    # Outputs ------------------------------------------------------------------------------------

    def set_duties(self, first_channel: int, duties: Sequence[float]) -> tuple[float, ...]:
        """Set neighbouring channels in one burst; return the duties really set, in 4096ths.

        0 is full-off and 1 full-on, without a pulse. The others go on at count 0 of the cycle, or
        staggered. Eight channels: 34 bytes, 0.77 ms at 400 kHz.
        Raises ValueError for a duty outside 0 to 1 or a channel that is not there, NotReady before
        bring-up; nothing was sent then.
        """
        if not self.is_running:
            raise self._not_ready("duties before bring-up", "it brought up first")
        if not 0 <= first_channel < first_channel + len(duties) <= CHANNELS:
            raise ValueError(
                f"{self.place}: {len(duties)} duties from channel {first_channel}, expected them "
                f"within 0 to {CHANNELS - 1}"
            )
        words: dict[float, int] = {}
        made: dict[float, float] = {}
        for duty in duties:
            if duty in words:  # pairs are often driven alike
                continue
            if not 0.0 <= duty <= 1.0:
                raise ValueError(f"{self.place}: a duty of {duty}, expected 0 to 1")
            counts = math.floor(duty * COUNTS + 0.5)
            made[duty] = counts / COUNTS
            words[duty] = counts << 16 if 0 < counts < COUNTS else FULL_ON if counts else FULL_OFF
        registers = list(map(words.__getitem__, duties))
        if self._on_step:
            registers = _staggered(registers, first_channel * self._on_step, self._on_step)
        first = LED0_ON_L + 4 * first_channel
        burst = BURSTS[len(registers)].pack(first, *registers)
        self._bus.transaction(self.address, (burst,))
        return tuple(map(made.__getitem__, duties))

    def read_outputs(self, first_channel: int, channels: int) -> bytes:
        """Read what neighbouring channels were set to, four bytes each, after bring-up.

        Another program may have changed it, above all switched off.
        """
        return self._read(LED0_ON_L + 4 * first_channel, 4 * channels)

    def stop_all(self) -> None:
        """Turn all 16 outputs off; six bytes, 145 us at 400 kHz, right in any state of the chip.

        MODE2 comes first: full-off of inverted outputs (INVRT) is full-on, and one register of a
        channel has no effect where all four are waited for (OCH).
        It overwrites the high bits of every off count: afterwards set each channel again.
        """
        self._write(MODE2, OUTDRV)
        self._write(ALL_LED_OFF_H, FULL)

    def stop(self, channels: Iterable[int]) -> None:
        """Turn these outputs off and no other, right in any state; three bytes and three for each.

        MODE2 comes first, as in `stop_all`: where that was changed, the others are driven as they
        were set again. It overwrites the high bits of their off counts: afterwards set each again.
        """
        self._write(MODE2, OUTDRV)
        for channel in channels:
            self._write(LED0_ON_L + 4 * channel + 3, FULL)

    def still_on(self) -> str | None:
        """Read back which outputs are not full-off, in a sentence; None if all are.

        Right in any state of the chip: two transactions, 1.7 ms at 400 kHz, or one for each channel
        and one more where the chip does not count registers up by itself.
        """
        if self._read(MODE1)[0] & AI:
            found = self._read(MODE2, LED0_ON_L + 4 * CHANNELS - MODE2)
            mode2, highs = found[0], found[LED0_ON_L + 3 - MODE2 :: 4]
        else:
            mode2 = self._read(MODE2)[0]
            registers = range(LED0_ON_L + 3, LED0_ON_L + 4 * CHANNELS, 4)
            highs = b"".join(self._read(each) for each in registers)
        if mode2 & (INVRT | OCH):
            return (
                f"{self.place}: MODE2 reads {mode2:02x}, so full-off may be on; expected neither "
                "INVRT nor OCH"
            )
        on = [str(channel) for channel, high in enumerate(highs) if not high & FULL]
        return f"{self.place}: outputs {', '.join(on)} are on" if on else None

    # Registers ----------------------------------------------------------------------------------

    def _set_rate(self, prescale: int) -> None:
        self._write(PRE_SCALE, prescale)
        self._prescale = prescale
        self.frequency_hz = actual_frequency_hz(prescale, self.osc_hz)


def _staggered(words: Iterable[int], first_on: int, step: int) -> list[int]:
    """The registers of neighbouring channels that are switched on one `step` after the other."""
    return [
        word if word in {FULL_ON, FULL_OFF} else ((word >> 16) + on) % COUNTS << 16 | on
        for on, word in zip(count(first_on, step), words)
    ]
