"""A compass as a hardware atomic model: a heading on request, or one every period."""

from dataclasses import dataclass
from typing import Protocol

from firmware_drivers.chips.bearing import Bearing, in_circle
from firmware_drivers.chips.step import Step
from firmware_drivers.hardware import BringUp, Chip, HardwareModel
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError

STOP, ONCE, PERIODIC = 0, 1, 2
"""Requests: no more headings, one heading now, a heading now and every period."""
FAULTS_BEFORE_BRING_UP = 3
"""Failed readings in a row after which the chip is brought up again: it may have lost supply."""


class BearingSensor(Chip, Protocol):
    """A compass driver: take the steps of `measurement`, then read the bearing."""

    @property
    def measurement(self) -> tuple[Step, ...]:
        """The steps of one measurement; none if the chip measures all the time."""

    def read_bearing(self) -> Bearing:
        """Give the bearing just measured."""


@dataclass(frozen=True, slots=True)
class CompassSettings:
    """Period of readings, and the sense of headings."""

    period: int
    """Ns from reading to reading when periodic; also until a failed reading is tried again."""
    whole_degrees: bool = False
    """Send headings as whole numbers, rounded: 359.6 is 0."""
    counterclockwise: bool = False
    """Headings grow to the left, as those of a compass mounted upside down do."""
    offset_deg: float = 0.0
    """Added to the heading at last, for the direction the sensor was mounted in."""


class Compass(HardwareModel):
    """Answers `request` with `heading_deg`, 0 up to but not including 360.

    bring_up (the steps' waits) --> idle;  a step failed --fault!--> bring_up (RETRY_AFTER)
    idle, resting --request? 1 or 2--> measuring (the measurement's waits)
    measuring, read --> reporting (0) --heading_deg!, calibration!--> idle, or resting if periodic
    measuring, failed --> reporting (0) --fault!--> resting, or bring_up after some in a row
    resting (rest of the period) --> measuring;  any --request? 0--> the same, then idle

    A request stays until it is answered: one that comes while measuring is answered by that
    measurement, one that fails is tried again. `calibration` is sent when it changes, never by a
    chip that does not judge itself. A heading may stand still; a chip whose raw field does hangs,
    and says so with each reading.
    """

    bring_up_proves = False

    def __init__(self, name: str, chip: BearingSensor, settings: CompassSettings) -> None:
        super().__init__(name, chip.bring_up, chip.line, settings.period)
        if settings.period <= 0:
            raise SettingError(
                f"period of {settings.period} ns", where=name, expected="more than 0 ns"
            )
        kind: type[float] = int if settings.whole_degrees else float
        self.request = self.in_port("request", int)
        self.heading_out = self.out_port("heading_deg", kind)
        self.calibration_out = self.out_port("calibration", int)
        self.chip = chip
        self.settings = settings
        self.wanted = STOP
        self.heading: float | None = None
        self.calibration: int | None = None
        self._is_calibration_new = False
        self._rest = settings.period
        """From the start of a measurement to that of the next."""
        self._since_start = 0
        self._measurement = BringUp(lambda: chip.measurement)

    def begin(self) -> None:
        """Measure if a request came meanwhile, else wait for one."""
        if self.wanted == STOP:
            self.passivate("idle")
        else:
            self._measure()

    def output(self) -> None:
        """Send the heading, and the calibration state if it changed; or the fault."""
        super().output()
        if self.heading is not None:
            self.heading_out.send(self.heading)
        if self._is_calibration_new and self.calibration is not None:
            self.calibration_out.send(self.calibration)

    def proceed(self) -> None:
        """Go on measuring, begin to, or rest until the period is over."""
        self.heading = None
        self._is_calibration_new = False
        if self.phase == "measuring":
            self._continue_measuring()
        elif self.phase == "resting":
            self.begin()
        elif self.consecutive_faults and self.consecutive_faults % FAULTS_BEFORE_BRING_UP == 0:
            self.bring_up_again()
        elif self.wanted == STOP:
            self.passivate("idle")
        else:
            self.hold_in("resting", max(0, self._rest - self._since_start))
            self._rest = self.settings.period

    def external(self, elapsed: int) -> None:
        """Take the request; measure at once unless busy. Once does not end periodic."""
        request = self.request[-1]
        if request not in (STOP, ONCE, PERIODIC):
            raise ValueError(f"{self.path}: request {request}, expected 0, 1 or 2")
        if (request, self.wanted) != (ONCE, PERIODIC):
            self.wanted = request
        if request != STOP and self.phase in {"idle", "resting"}:
            self._measure()
            return
        if request != STOP and self.phase == "reporting":
            self._rest = 0
        self.continue_(elapsed)

    # ---------------------------------------------------------------------------------------------

    def _measure(self) -> None:
        self._measurement.restart()
        self._since_start = 0
        self.activate("measuring")

    def _continue_measuring(self) -> None:
        try:
            wait = self._measurement.take()
            if wait is not None:
                self.hold_after_transfer("measuring", wait)
                self._since_start += self.sigma
                return
            bearing = self.chip.read_bearing()
        except HalError as error:
            self.note(error)
        else:
            self.consecutive_faults = 0
            self._take(bearing)
        self.activate("reporting")

    def _take(self, bearing: Bearing) -> None:
        self._is_calibration_new = bearing.calibration != self.calibration
        self.calibration = bearing.calibration
        if self.wanted != STOP:
            self.heading = self._heading_of(bearing.bearing_deg)
        if self.wanted == ONCE:
            self.wanted = STOP

    def _heading_of(self, bearing_deg: float) -> float:
        sense = -1 if self.settings.counterclockwise else 1
        heading = in_circle(sense * bearing_deg + self.settings.offset_deg)
        return round(heading) % 360 if self.settings.whole_degrees else heading
