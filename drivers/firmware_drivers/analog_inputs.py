"""Several inputs of an analog-to-digital converter as a hardware atomic model, read in turn."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from firmware_drivers.chips.step import Step, duration_ns
from firmware_drivers.hardware import Chip, HardwareModel
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError


class Converter(Chip, Protocol):
    """A converter's driver: a measurement is begun by its steps, and read once."""

    def measurement(self, inputs: str) -> tuple[Step, ...]:
        """Give the step of one conversion. Raises SettingError for inputs there are not."""

    def read_voltage(self) -> float:
        """Read the last conversion, in V."""


class Voltages(NamedTuple):
    """One reading of all inputs, in V, in the order of the settings; one after the other."""

    volts: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class AnalogInputsSettings:
    """Inputs that are measured, and their period."""

    inputs: Sequence[str]
    """As the chip names them, such as `AIN0` or `AIN0-AIN1`."""
    period: int
    """Ns from one reading of all inputs to the next."""


class AnalogInputs(HardwareModel):
    """Measures every input in turn, every period; sends `voltages` when it has them all.

    bring_up (the steps' waits) --> resting (0);  a step failed --fault!--> bring_up (RETRY_AFTER)
    resting --> converting (the conversion) --> converting, for each input --> reporting (0)
    reporting --voltages!--> resting (rest of the period)
    converting, chip silent or reset --> reporting (0) --fault!--> bring_up

    A reading is sent whole or not at all.
    """

    bring_up_proves = False

    def __init__(self, name: str, chip: Converter, settings: AnalogInputsSettings) -> None:
        super().__init__(name, chip.bring_up, chip.line)
        self._conversions = [step for (step,) in map(chip.measurement, settings.inputs)]
        least = duration_ns(self._conversions)
        if not self._conversions or settings.period < least:
            raise SettingError(
                f"{name} on {chip.place}: {len(settings.inputs)} inputs in {settings.period} ns",
                expected=f"one or more, and {least} ns for their conversions",
            )
        self.voltages = self.out_port("voltages", Voltages)
        self.chip = chip
        self.settings = settings
        self._volts: list[float] = []
        self._since_begin = 0
        self._has_failed = False

    def begin(self) -> None:
        """Measure at once."""
        self._since_begin = self.settings.period
        self.activate("resting")

    def output(self) -> None:
        """Send the voltages, or the fault."""
        super().output()
        if self.phase == "reporting" and not self._has_failed:
            self.voltages.send(Voltages(tuple(self._volts)))

    def proceed(self) -> None:
        """Read what was converted, begin the next conversion, or rest."""
        if self.phase == "reporting":
            self._rest()
        elif self.phase == "resting":
            self._volts.clear()
            self._since_begin = 0
            self._convert()
        else:
            self._since_begin += self.sigma
            self._read()

    # ---------------------------------------------------------------------------------------------

    def _convert(self) -> None:
        step = self._conversions[len(self._volts)]
        try:
            step.action()
        except HalError as error:
            self._fail(error)
        else:
            self.hold_after_transfer("converting", step.wait_ns)

    def _read(self) -> None:
        try:
            self._volts.append(self.chip.read_voltage())
        except HalError as error:
            self._fail(error)
            return
        self.consecutive_faults = 0
        if len(self._volts) == len(self._conversions):
            self.activate("reporting")
        else:
            self._convert()

    def _rest(self) -> None:
        if self._has_failed:
            self._has_failed = False
            self.bring_up_again()
        else:
            self.hold_in("resting", max(0, self.settings.period - self._since_begin))

    def _fail(self, error: HalError) -> None:
        self.note(error)
        self._has_failed = True
        self.activate("reporting")
