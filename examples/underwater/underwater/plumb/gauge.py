"""The Plumb as a hardware atomic model: a sounding every period."""

from firmware_drivers.hardware import HardwareModel

from firmware_runtime import HalError
from underwater.plumb.driver import CONVERSION_NS, PRESSURE, TEMPERATURE, Plumb, Sounding


class Gauge(HardwareModel):
    """Converts and reads every `period` ns, and sends the `sounding`.

    bring_up --> resting (0) --> converting, once for each count --> reporting (0)
    reporting --sounding!, or fault!--> resting (what is left of the period) --> converting
    """

    def __init__(self, name: str, chip: Plumb, period: int) -> None:
        super().__init__(name, chip.bring_up, chip.line)
        self.sounding_out = self.out_port("sounding", Sounding)
        self.chip = chip
        self.period = period
        self.sounding: Sounding | None = None
        self._counts: list[int] = []
        self._since_begin = period

    def begin(self) -> None:
        """Measure at once."""
        self._since_begin = self.period
        self._rest()

    def output(self) -> None:
        """Send the sounding, or what went wrong."""
        super().output()
        if self.sounding is not None:
            self.sounding_out.send(self.sounding)

    def proceed(self) -> None:
        """Do what is due; a HalError is a fault, and there is no sounding in this period."""
        self.sounding = None
        if self.phase == "reporting":
            self._rest()
            return
        self._since_begin += self.sigma
        try:
            self._measure()
        except HalError as error:
            self.note(error)
            self.activate("reporting")

    def _measure(self) -> None:
        if self.phase == "resting":
            self._counts, self._since_begin = [], 0
        else:
            self._counts.append(self.chip.read())
        if len(self._counts) == 2:
            self.sounding = self.chip.sounding(*self._counts)
            self.consecutive_faults = 0
            self.activate("reporting")
        else:
            self.chip.begin((PRESSURE, TEMPERATURE)[len(self._counts)])
            self.hold_after_transfer("converting", CONVERSION_NS)

    def _rest(self) -> None:
        self.hold_in("resting", max(0, self.period - self._since_begin))
