"""The inertial measurement unit as a hardware atomic model: an MPU-9250 read every period."""

from drivers.bring_up import RETRY_AFTER, BringUp, failed_in_a_row
from drivers.chips.mpu9250 import Mpu9250
from drivers.chips.mpu9250_burst import InertialSample
from drivers.fault import Fault
from drivers.gyro_bias import GyroBias
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.hal.errors import HalError, NotReady

FAULTS_BEFORE_BRING_UP = 10
"""Failed reads in a row after which the chip is brought up anew: it may have lost its supply."""

REPEATS_BEFORE_CHECK = 5
"""Magnetometer readings in a row without any change after which it is asked whether it lives."""


class Imu(Atomic):
    """Brings the chip up, measures the gyro's bias at rest, then sends one sample a period.

    bring_up (period, step by step) --> calibrating (period, sample by sample) --> sampling (period)
    sampling, read --> reporting (0) --sample!--> sampling
    any of them, failed --> reporting (0) --fault!--> the same, or bring_up

    It is activated every period from the start on, so its accounting begins with the run; a step of
    the bring-up that has to wait lets periods pass. A read that fails is reported as a fault and
    nothing else: no sample is made up and no old one sent again. The bias outlives a new bring-up.
    """

    def __init__(self, name: str, chip: Mpu9250, period: int, bias: GyroBias) -> None:
        super().__init__(name)
        self.sample = self.out_port("sample", InertialSample)
        self.fault_out = self.out_port("fault", Fault)
        self.chip = chip
        self.period = period
        self.stage = "bring_up"
        self.bias = (0.0, 0.0, 0.0)
        self.consecutive_faults = 0
        self._bias_measurement = bias
        self._is_calibrated = False
        self._moved = ""
        self._bring_up = BringUp(chip.bring_up)
        self._wait_left = 0
        self._report: InertialSample | Fault | None = None

    def unready(self) -> str | None:
        """Why there are no samples, in a few words; None if there are."""
        if self.stage == "calibrating" and self._moved:
            return f"is not calibrated yet{self._moved}"
        if self.consecutive_faults > 0:
            return failed_in_a_row(self.consecutive_faults)
        if self.stage == "calibrating":
            return "is not calibrated yet"
        return None if self.stage == "sampling" else "is not up yet"

    def initialize(self) -> None:
        """Begin the bring-up at once."""
        self._bring_up.restart()
        self._bias_measurement.restart()
        self.hold_in(self.stage, 0)

    def output(self) -> None:
        """Send what the last activation found."""
        if isinstance(self._report, Fault):
            self.fault_out.send(self._report)
        elif self._report is not None:
            self.sample.send(self._report)

    def internal(self) -> None:
        """Do what the stage is for, report it, and hold for the rest of the period."""
        if self._report is not None:
            self._report = None
            self.hold_in(self.stage, self.period)
            return
        try:
            self._report = self._act()
        except HalError as error:
            self._report = self._fail(error)
        if self._report is not None:
            self.activate("reporting")
        else:
            self.hold_in(self.stage, self.period)

    # ---------------------------------------------------------------------------------------------

    def _act(self) -> InertialSample | Fault | None:
        if self.stage == "bring_up":
            return self._continue_bring_up()
        sample = self.chip.read_sample()
        self.consecutive_faults = 0
        if self._has_lost_field():
            return self._new_warning()
        if self.stage == "calibrating":
            self._calibrate(sample)
            return None
        return self._without_bias(sample)

    def _continue_bring_up(self) -> Fault | None:
        """Take every step that is due; a step's wait ends with a whole number of periods.

        It counts from when the step's transactions have ended on the wire.
        """
        self._wait_left -= self.period
        while self._wait_left <= 0:
            wait = self._bring_up.take()
            if wait is None:
                self.stage = "sampling" if self._is_calibrated else "calibrating"
                return self._new_warning()
            self._wait_left = wait and self.chip.line.elapsed() + wait
        return None

    def _has_lost_field(self) -> bool:
        """True once, when the magnetometer is found dead; the chip would show its last field on."""
        repeats = self.chip.field_repeats
        is_suspicious = repeats > 0 and repeats % REPEATS_BEFORE_CHECK == 0
        return is_suspicious and not self.chip.check_magnetometer()

    def _new_warning(self) -> Fault | None:
        if not self.chip.warnings:
            return None
        return Fault("Warning", "; ".join(self.chip.warnings), self.consecutive_faults)

    def _calibrate(self, sample: InertialSample) -> None:
        measurement = self._bias_measurement
        measurement.add(sample.rate)
        if not measurement.is_complete:
            return
        try:
            self.bias = measurement.mean()
        except NotReady as error:
            self._moved = f" ({error})"
            raise
        finally:
            measurement.restart()
        self._is_calibrated = True
        self.stage = "sampling"

    def _without_bias(self, sample: InertialSample) -> InertialSample:
        (x, y, z), (bias_x, bias_y, bias_z) = sample.rate, self.bias
        return sample._replace(rate=(x - bias_x, y - bias_y, z - bias_z))

    def _fail(self, error: HalError) -> Fault:
        self.consecutive_faults += 1
        if self.stage == "bring_up":
            self._wait_left = RETRY_AFTER
        elif self.consecutive_faults % FAULTS_BEFORE_BRING_UP == 0:
            self.stage = "bring_up"
            self._wait_left = 0
            self._bring_up.restart()
        return Fault.of(error, self.consecutive_faults)
