"""The winch's encoder as a hardware atomic model: a place every period."""

from firmware_drivers.chips.step import Step
from firmware_drivers.hardware import HardwareModel

from firmware_runtime.hal.wire_errors import HalError
from underwater.winch.driver import Winch


class Ruler(HardwareModel):
    """Reads the chip every `period` ns and sends the `place`, in m.

    bring_up (identify) --> waiting (period) --> reporting (0) --place!, or fault!--> waiting

    A reading that fails is a fault and nothing else: no old place is sent again.
    """

    def __init__(self, name: str, chip: Winch, period: int) -> None:
        # Nothing is written: what drives the chip brings it up, at an instant of its own.
        super().__init__(name, lambda: (Step("identify", chip.identify, 0),), chip.line)
        self.place_out = self.out_port("place", float)
        self.chip = chip
        self.period = period
        self.place_m: float | None = None

    def begin(self) -> None:
        """Read a period after the bring-up."""
        self.hold_in("waiting", self.period)

    def output(self) -> None:
        """Send the place, or what went wrong."""
        super().output()
        if self.place_m is not None:
            self.place_out.send(self.place_m)

    def proceed(self) -> None:
        """Read, or wait for the next reading."""
        self.place_m = None
        if self.phase == "reporting":
            self.hold_in("waiting", self.period)
            return
        try:
            self.place_m = self.chip.read_place_m()
        except HalError as error:
            self.note(error)
        else:
            self.consecutive_faults = 0
        self.activate("reporting")
