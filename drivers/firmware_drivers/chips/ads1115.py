"""Texas Instruments ADS1115, a 16-bit ADC with four inputs on I2C (TI data sheet SBAS444).

The driver takes single conversions, each of one input or of the difference of two. The settings
are written with every start, and every reading brings them with it, so a chip that lost power is
detected at once: a comparator bit that has no effect is set in ours and not at power-up. A code at
the end of the scale is a voltage beyond it, and is no reading.

A voltage that stands still is distinguished from a converter that does by its full scale: after
`SAME_BEFORE_PROOF` equal codes of an input one conversion has another full scale, and so another
code. One that stays the same is stuck. A code within `NEAR_ZERO` of zero proves nothing.

Responsible for: settings, start, waiting times, codes to V. Not for: continuous conversion, the
comparator and the ALERT/RDY pin, general-call reset (it resets other chips too). An input may not
go below GND or above VDD by more than 0.3 V, whatever the full scale is. The chip has no identity
register: what does not keep the settings, or keeps OS as written too, is not an ADS1115, but an
ADS1114 would pass.
"""

from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Final

from firmware_drivers.chips.i2c_chip import I2cChip, choice_fault
from firmware_drivers.chips.step import Step
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import Implausible, Stuck

ADDRESSES: Final = (0x48, 0x49, 0x4A, 0x4B)
"""ADDR at GND, VDD, SDA, SCL."""

CONVERSION: Final = 0x00
CONFIG: Final = 0x01
LO_THRESH: Final = 0x02
HI_THRESH: Final = 0x03

OS: Final = 0x8000
"""Config: written 1 starts a conversion; reads 0 while one goes on."""
SINGLE_SHOT: Final = 0x0100
LATCHING: Final = 0x0004
"""COMP_LAT, without effect while the comparator is off; marks our settings, unlike power-up's."""
COMPARATOR_OFF: Final = 0x0003

CODES_OF_INPUTS: Final = MappingProxyType(
    {
        "AIN0-AIN1": 0,
        "AIN0-AIN3": 1,
        "AIN1-AIN3": 2,
        "AIN2-AIN3": 3,
        "AIN0": 4,
        "AIN1": 5,
        "AIN2": 6,
        "AIN3": 7,
    }
)
"""MUX: two inputs, or one against GND."""
CODES_OF_FULL_SCALES: Final = MappingProxyType(
    {6.144: 0, 4.096: 1, 2.048: 2, 1.024: 3, 0.512: 4, 0.256: 5}
)
"""PGA, by full scale in V."""
CODES_OF_RATES: Final = MappingProxyType(
    {8: 0, 16: 1, 32: 2, 64: 3, 128: 4, 250: 5, 475: 6, 860: 7}
)
"""DR, by conversions a second."""
WAKE_UP_NS: Final = 25_000
SLOWEST: Final = 1.1
"""A conversion takes a tenth longer than nominal at most."""
LEAST: Final = -0x8000
LARGEST: Final = 0x7FFF
SAME_BEFORE_PROOF: Final = 64
NEAR_ZERO: Final = 16
OTHER_FULL_SCALES: Final = MappingProxyType(
    {6.144: 4.096, 4.096: 6.144, 2.048: 4.096, 1.024: 2.048, 0.512: 1.024, 0.256: 0.512}
)
"""The one to prove by; a larger one where there is, in which every voltage fits."""
TRAFFIC: Final[tuple[tuple[Message, ...], ...]] = (
    (bytes((CONFIG, 0, 0)),),
    (bytes((CONFIG,)), 2),
    (bytes((CONVERSION,)), 2),
)
"""Transactions of one measurement, start and reading, for the bus-time budget."""
LEAST_INPUT_V: Final = -0.3
"""Voltage of one input below which the part is destroyed: no such reading was measured."""


def conversion_ns(rate_sps: int) -> int:
    """Return how long a conversion takes at most, waking up included."""
    return WAKE_UP_NS + round(1e9 / rate_sps * SLOWEST)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ads1115Settings:
    """Full scale and rate of all conversions; either may be wrong until `faults` was checked."""

    full_scale_v: float = 2.048
    """A voltage from minus this to this can be read."""
    rate_sps: int = 128
    """Conversions a second: 1 / rate is how long one takes, and a slow one has less noise."""

    def faults(self) -> tuple[str, ...]:
        """List every setting the chip cannot have, a sentence each."""
        return (
            *choice_fault("full_scale_v", self.full_scale_v, CODES_OF_FULL_SCALES),
            *choice_fault("rate_sps", self.rate_sps, CODES_OF_RATES),
        )

    def config(self, inputs: str, full_scale_v: float | None = None) -> int:
        """Give the content of Config for these inputs, OS apart, at its full scale or another."""
        return (
            CODES_OF_INPUTS[inputs] << 12
            | CODES_OF_FULL_SCALES[full_scale_v or self.full_scale_v] << 9
            | SINGLE_SHOT
            | CODES_OF_RATES[self.rate_sps] << 5
            | LATCHING
            | COMPARATOR_OFF
        )


class Ads1115(I2cChip):
    """One ADS1115: take the steps of a `measurement` of some inputs, then read it, once."""

    chip = "ADS1115"
    addresses = ADDRESSES

    def __init__(
        self,
        bus: I2cBus,
        address: int = ADDRESSES[0],
        settings: Ads1115Settings | None = None,
    ) -> None:
        self.settings = settings or Ads1115Settings()
        super().__init__(bus, address, self.settings.faults())
        self.conversion_ns = conversion_ns(self.settings.rate_sps)
        self._full_scale_v = self.settings.full_scale_v
        self._inputs = "AIN0"
        self._codes: dict[str, tuple[int, int]] = {}
        """Last code of each input, and how often in a row it came."""
        self._config = self.settings.config(self._inputs)
        self._is_measuring = False

    # Bring-up -----------------------------------------------------------------------------------

    def bring_up(self) -> tuple[Step, ...]:
        """Give the steps from any state to ready; they raise NoAcknowledge or WrongDevice.

        A conversion that a former program began is waited for, at the slowest rate there is.
        """
        return (
            Step("configure", self._configure, conversion_ns(min(CODES_OF_RATES))),
            Step("find it idle", self._find_it_idle, 0),
        )

    def identify(self) -> None:
        """Check that the thresholds read as at power-up; nothing is written but the pointer.

        Raises WrongDevice if not; so it is no ADS1115, or another program uses its comparator.
        """
        found = [self._read_word(register) for register in (LO_THRESH, HI_THRESH)]
        if found != [0x8000, 0x7FFF]:
            raise self._wrong_device(
                f"Lo_thresh, Hi_thresh read {found[0]:04x} {found[1]:04x}", "8000 7fff"
            )

    def verify(self) -> None:
        """Check that the settings still are those written last. Raises NotReady if not."""
        self._compare(self._read_word(CONFIG))

    # Measurements -------------------------------------------------------------------------------

    def measurement(self, inputs: str) -> tuple[Step, ...]:
        """Give the step that starts a conversion of `AIN0`, or of `AIN0-AIN1`, and waits for it.

        Raises SettingError for inputs the chip cannot choose.
        """
        if inputs not in CODES_OF_INPUTS:
            choices = ", ".join(CODES_OF_INPUTS)
            raise SettingError(
                f"inputs: {inputs!r}", where=self.place, expected=f"one of {choices}"
            )
        return (Step(f"convert {inputs}", partial(self._start, inputs), self.conversion_ns),)

    def read_voltage(self) -> float:
        """Read the conversion started last, in V.

        Two transactions of two bytes, 0.24 ms at 400 kHz.
        Raises NotReady if none was started or it is not done, if the voltage is beyond the full
        scale, or if the chip was reset; Stuck if the code stays the same at another full scale;
        Implausible if one input is further below GND than any may be; NoAcknowledge if it is gone.
        """
        if not self._is_measuring:
            raise self._not_ready("no conversion to read", "one started, not read")
        config = self._read_word(CONFIG)
        self._compare(config)
        if not config & OS:
            raise self._not_ready(f"Config reads {config:04x}", "OS set, a code done")
        code = self._read_word(CONVERSION)
        self._is_measuring = False
        signed = code - 0x10000 if code & 0x8000 else code
        if signed in {LEAST, LARGEST}:
            raise self._not_ready(
                f"code reads {code:04x}", f"a voltage within {self._full_scale_v} V"
            )
        self._prove(signed)
        volts = signed * self._full_scale_v / -LEAST
        if volts < LEAST_INPUT_V and "-" not in self._inputs:
            expected = f"{LEAST_INPUT_V} V or more against GND"
            raise Implausible(self.place, self._inputs, volts, expected)
        return volts

    # ---------------------------------------------------------------------------------------------

    def _configure(self) -> None:
        self._is_measuring = False
        with self._must_answer("Config"):
            self._write_config(self._config)
            found = self._read_word(CONFIG)
        if (found ^ self._config) & ~OS:
            raise self._wrong_device(f"Config reads {found:04x}", f"{self._config:04x} as written")

    def _find_it_idle(self) -> None:
        """Check that OS, written 0, reads 1 once nothing is converted: a memory keeps the 0."""
        found = self._read_word(CONFIG)
        if not found & OS:
            raise self._wrong_device(
                f"not an ADS1115: Config reads {found:04x} with no conversion begun", "OS set"
            )

    def _prove(self, code: int) -> None:
        """Count codes that repeat themselves. Raises Stuck for one that must not."""
        last, times = self._codes.get(self._inputs, (0, 0))
        if self._full_scale_v == self.settings.full_scale_v:
            self._codes[self._inputs] = code, times + 1 if code == last else 1
        elif code == last:
            self._codes[self._inputs] = code, times + 1
            raise Stuck(self.place, self._inputs, code, times + 1)
        else:
            self._codes[self._inputs] = 0, 0

    def _full_scale_of(self, inputs: str) -> float:
        """The full scale of the next conversion: another one if the code stood still for long."""
        full_scale_v = self.settings.full_scale_v
        code, times = self._codes.get(inputs, (0, 0))
        other_v = OTHER_FULL_SCALES[full_scale_v]
        fits = abs(code) * full_scale_v < 0.9 * other_v * LARGEST
        if times >= SAME_BEFORE_PROOF and abs(code) > NEAR_ZERO and fits:
            return other_v
        return full_scale_v

    def _start(self, inputs: str) -> None:
        self._is_measuring = False
        self._inputs = inputs
        self._full_scale_v = self._full_scale_of(inputs)
        self._config = self.settings.config(inputs, self._full_scale_v)
        self._write_config(self._config | OS)
        self._is_measuring = True

    def _compare(self, found: int) -> None:
        if (found ^ self._config) & ~OS:
            expected = f"{self._config:04x} but for OS"
            raise self._was_changed(f"Config reads {found:04x}", expected)

    def _read_word(self, register: int) -> int:
        return int.from_bytes(self._read(register, 2), "big")

    def _write_config(self, word: int) -> None:
        self._write(CONFIG, word >> 8, word & 0xFF)
