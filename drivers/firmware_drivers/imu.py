"""The inertial measurement unit as a hardware atomic model: an MPU-9250 read every period."""

from firmware_drivers.chips.mpu9250 import Mpu9250, without_field
from firmware_drivers.chips.mpu9250_burst import NO_BIAS, InertialSample
from firmware_drivers.gyro_bias import GyroBias
from firmware_drivers.hardware import HardwareModel
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import WARNING, Fault, HalError, NotReady

FAULTS_BEFORE_BRING_UP = 10
"""Failed reads in a row after which the chip is brought up again: it may have lost its supply."""
_NO_ANSWER = "its AK8963 stopped answering, expected an acknowledge"
_READS = frozenset({"calibrating", "sampling"})


class Imu(HardwareModel):
    """Brings the chip up, measures the gyro's bias at rest, then sends one sample a period.

    bring_up (period, step by step) --> calibrating (period, sample by sample) --> sampling (period)
    sampling, read --> reporting (0) --sample!--> sampling
    calibrating, sampling, failed --> reporting (0) --fault!--> the same, or bring_up after some

    It is activated every period from the start on, so its accounting begins with the run; a wait of
    the bring-up lasts for whole periods. A read that fails is reported as a fault and nothing else:
    no sample is made up and no old one sent again. The same holds for readings that no living chip
    gives; a magnetometer that is stuck is reported once and costs the field alone. The bias
    outlives a new bring-up.

    The chip has a clock of its own: one that samples no faster than it is read has nothing new now
    and then, which is a fault. Raises SettingError where it samples more slowly.
    """

    bring_up_proves = False

    def __init__(self, name: str, chip: Mpu9250, period: int, bias: GyroBias) -> None:
        if chip.settings.sample_hz * period < SECOND:
            raise SettingError(
                f"{name} on {chip.place}: sample_hz: {chip.settings.sample_hz}",
                expected=f"more than {SECOND / period:g}, at which it is read",
            )
        super().__init__(name, chip.bring_up, chip.line, period)
        self.sample = self.out_port("sample", InertialSample)
        self.chip = chip
        self.chip.read_every(period)
        self.period = period
        self.bias = NO_BIAS
        """Bias of the rate, in rad/s; none until it has been measured."""
        self._sample: InertialSample | None = None
        self._bias_measurement = bias
        self._is_calibrated = False
        self._moved = ""
        self._has_lost_field = self._is_bring_up_due = False
        self._periods_left = 0

    def unready(self) -> str | None:
        """Return why there are no samples, in a few words; None if there are."""
        if self._is_calibrated or self.phase.startswith("bring_up"):
            return super().unready()
        if self._moved:
            return f"is not calibrated yet{self._moved}"
        return super().unready() or "is not calibrated yet"

    def initialize(self) -> None:
        """Begin the bring-up at once."""
        self._bias_measurement.restart()
        super().initialize()

    def begin(self) -> None:
        """Read a period after the bring-up; report what works less well than it should."""
        if self._note_warnings():
            self.activate("reporting")
        else:
            self._hold()

    def output(self) -> None:
        """Send the sample, or what went wrong."""
        if self.faults:
            super().output()
        if self._sample is not None:
            self.sample.send(self._sample)

    def continue_bring_up(self) -> None:
        """Let one more period pass, or take the next step."""
        if self._periods_left > 0:
            self._let_period_pass()
        else:
            super().continue_bring_up()

    def internal(self) -> None:
        """Read a sample, hold for the rest of the period, or bring the chip up."""
        phase = self.phase
        if phase in _READS:
            self.faults.clear()
            self._read()
        elif phase == "reporting" and not self._is_bring_up_due:
            self.faults.clear()
            self._sample = None
            self._hold()
        else:
            super().internal()

    def proceed(self) -> None:
        """Begin another bring-up: too many reads in a row have failed."""
        self._is_bring_up_due = False
        self._bring_up.restart()
        self.wait_in_bring_up(self.period)

    def wait_in_bring_up(self, duration: int) -> None:
        """Let whole periods pass, with an activation each."""
        self._periods_left = -(-duration // self.period)
        self._let_period_pass()

    # ---------------------------------------------------------------------------------------------

    def _let_period_pass(self) -> None:
        self._periods_left -= 1
        self.hold_in("bring_up", self.period)

    def _hold(self) -> None:
        self.hold_in("sampling" if self._is_calibrated else "calibrating", self.period)

    def _read(self) -> None:
        """Read one sample; it, a fault or a warning is reported."""
        try:
            sample = self.chip.read_sample(self.bias)
            if self._consecutive_faults > 0 or not self._has_worked:
                self.consecutive_faults = 0
            has_news = (sample.field is None or self._has_lost_field) and self._check_field()
            if self._is_calibrated:
                self._sample = sample
            else:
                self._calibrate(sample)
        except HalError as error:
            self.note(error)
            self._is_bring_up_due = self.consecutive_faults % FAULTS_BEFORE_BRING_UP == 0
            has_news = True
        if has_news or self._sample is not None:
            self.activate("reporting")
        else:
            self._hold()

    def _check_field(self) -> bool:
        """Report a magnetometer that is stuck, or gone, once; there is no field meanwhile."""
        stuck = self.chip.stuck_field
        has_been_lost, self._has_lost_field = self._has_lost_field, stuck is not None
        if stuck is None or has_been_lost:
            return False
        if self.chip.check_magnetometer():
            fault = Fault.of(stuck, self.consecutive_faults, self.period)
        else:
            fault = self._warning(without_field(self.chip.place, _NO_ANSWER))
        self.faults.append(fault)
        return True

    def _note_warnings(self) -> bool:
        """Keep what the chip warns of for the next output; it is no fault in a row."""
        if self.chip.warnings:
            self.faults.append(self._warning("; ".join(self.chip.warnings)))
        return bool(self.chip.warnings)

    def _warning(self, text: str) -> Fault:
        return Fault(WARNING, text, self.consecutive_faults)

    def _calibrate(self, sample: InertialSample) -> None:
        measurement = self._bias_measurement
        measurement.add(sample.rate, sample.field)
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
