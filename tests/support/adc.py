"""A converter of the tests' own: double, driver and two hardware models that wait for it.

One model counts the conversion from its activation and so forgets that the command that starts it
takes time on the wire; the other counts from the end of the transfer.
"""

from abc import abstractmethod

from firmware_drivers.chips.step import Step
from firmware_drivers.hardware import HardwareModel

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import HalError, NotReady
from sim_doubles.chips.register_target import RegisterTarget
from sim_doubles.clock import Now

ADDRESS = 0x48
VALUE, CONTROL = 0x00, 0x01
CONVERSION = 1160 * MICROSECOND
TOO_SHORT = 1300 * MICROSECOND
"""More than a conversion takes, and less than one with the command that starts it at 100 kHz."""
READING = 0x1234


class AdcDouble(RegisterTarget):
    """Converts when CONTROL is written; until that is done VALUE reads 0xFFFF."""

    def __init__(self, now: Now) -> None:
        super().__init__(now, ADDRESS)
        self.done_at = 0

    def _read_register(self, register: int) -> int:
        if self._at < self.done_at:
            return 0xFF
        return READING.to_bytes(2, "big")[register & 1]

    def _write_register(self, register: int, byte: int) -> None:  # noqa: ARG002 -- one command
        self.done_at = self._at + CONVERSION


class Adc:
    """Starts conversions and reads them."""

    def __init__(self, bus: I2cBus) -> None:
        self.line = self._bus = bus

    def bring_up(self) -> tuple[Step, ...]:
        return ()

    def start(self) -> None:
        self._bus.write(ADDRESS, bytes((CONTROL, 0x80, 0x00)))

    def read(self) -> int:
        found = int.from_bytes(self._bus.write_read(ADDRESS, bytes((VALUE,)), 2), "big")
        if found == 0xFFFF:
            raise NotReady("ADC: no conversion done, expected one")
        return found


class Sampler(HardwareModel):
    """Converts and reads, over and over.

    converting (`wait`) --> reporting (0) --reading! or fault!--> converting
    """

    def __init__(self, adc: Adc) -> None:
        super().__init__("sampler", adc.bring_up, adc.line)
        self.reading_out = self.out_port("reading", int)
        self.adc = adc
        self.reading: int | None = None

    @abstractmethod
    def wait(self) -> None:
        """Enter `converting` for as long as it takes for a conversion."""

    def begin(self) -> None:
        self.adc.start()
        self.wait()

    def output(self) -> None:
        super().output()
        if self.reading is not None:
            self.reading_out.send(self.reading)

    def proceed(self) -> None:
        self.reading = None
        if self.phase == "reporting":
            self.begin()
            return
        try:
            self.reading = self.adc.read()
        except HalError as error:
            self.note(error)
        self.activate("reporting")


class HastySampler(Sampler):
    """Counts from its activation."""

    def wait(self) -> None:
        self.hold_in("converting", TOO_SHORT)


class PatientSampler(Sampler):
    """Counts from the end of the transfer."""

    def wait(self) -> None:
        self.hold_after_transfer("converting", CONVERSION)
