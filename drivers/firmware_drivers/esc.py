"""An electronic speed controller on one channel of a PCA9685, such as that of a propeller.

An ESC takes pulses of about 1000 to 2000 us and refuses to turn until it has seen the low one for
some seconds. Full-off is "no signal": the ESC stops by itself and must be armed again.

The model has its chip to itself: a stop turns all sixteen outputs full-off.
"""

import math

from msgspec import Struct

from firmware_drivers.actuator import POLL_EVERY, Actuator
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.pca9685_registers import CHANNELS, NOMINAL_OSC_HZ, actual_cycle_us
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.interlock import Interlock, always_enabled, poll_period
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.models.motion import Applied


class EscSettings(Struct, frozen=True):
    """Pulses and arming of one ESC."""

    channel: int
    frequency_hz: float
    """Pulse rate; it is the whole chip's."""
    low_pulse_us: float
    """Pulse that arms and stands for throttle 0."""
    high_pulse_us: float
    """Pulse of throttle 1."""
    arming: int
    """Ns the low pulse is held before throttle is obeyed."""
    timeout: int = NEVER
    """Ns without a new throttle after which an armed ESC is disarmed."""

    def faults(self, osc_hz: float = NOMINAL_OSC_HZ) -> list[str]:
        """List what cannot be, a sentence each; low and high changed places arm at full power.

        `osc_hz` is the oscillator of the chip, as it was measured.
        """
        faults = []
        if not 0 <= self.channel < CHANNELS:
            faults.append(f"channel: {self.channel}, expected 0 to {CHANNELS - 1}")
        if not 0 < self.frequency_hz < math.inf:
            return [*faults, f"frequency_hz: {self.frequency_hz}, expected more than 0"]
        try:
            cycle_us = actual_cycle_us(self.frequency_hz, osc_hz)
        except SettingError as error:
            return [*faults, f"frequency_hz: {error}"]
        if not 0 < self.low_pulse_us < self.high_pulse_us < cycle_us:
            faults.append(
                f"low_pulse_us, high_pulse_us: {self.low_pulse_us}, {self.high_pulse_us}, expected "
                f"more than 0, the second greater, and less than a cycle, {cycle_us:.0f}"
            )
        if self.arming < 0:
            faults.append(f"arming: {self.arming} ns, expected 0 or more")
        if self.timeout <= 0:
            faults.append(f"timeout: {self.timeout} ns, expected more than 0")
        return faults


class Esc(Actuator):
    """Obeys `throttle` (0 to 1) once armed; sends `armed` when it is and when it no longer is.

    off --arm? true--> arming (settings.arming) --armed! true--> armed --throttle?--> armed
    arming, armed --arm? false--> stopped --> reporting (0) --armed! false--> off
    armed, no throttle for settings.timeout --> stopped --> reporting --armed! false--> off
    arming, armed, chip silent or throttle not a number --> stopped --> reporting --armed! false-->
    off, to be armed with outputs disabled --> disabled, then enabled --> arming
    armed, outputs disabled --> stopped --> reporting --armed! false--> disabled

    The other phases are those of `Actuator`. An `arm` that comes during the bring-up, or while the
    interlock disables outputs, is kept.
    """

    def __init__(
        self, name: str, chip: Pca9685, settings: EscSettings, interlock: Interlock = always_enabled
    ) -> None:
        if faults := settings.faults(chip.osc_hz):
            raise SettingError(f"{name} on {chip.place}: {'; '.join(faults)}")
        chip.users.add(name, stops_all=True)
        super().__init__(name, lambda: chip.bring_up(settings.frequency_hz), chip.line, interlock)
        self.arm = self.in_port("arm", bool)
        self.throttle = self.in_port("throttle", float)
        self.armed_out = self.out_port("armed", bool)
        self.chip = chip
        self.settings = settings
        self.wants_armed = False
        self._since_throttle = 0

    def output(self) -> None:
        """Send what changed: armed after arming, disarmed and why when reporting."""
        super().output()
        if self.phase == "arming":
            self.armed_out.send(True)
        elif self.phase == "reporting":
            self.armed_out.send(False)

    def external(self, elapsed: int) -> None:
        """Arm or disarm; set the throttle if armed."""
        if self.phase == "armed":
            self.since_poll += elapsed
            self._since_throttle += elapsed
        if self.arm:
            self.wants_armed = self.arm[-1]
        if self.phase.startswith("bring_up"):
            self.continue_(elapsed)
        elif self.wants_armed and self.phase == "off":
            self.settle()
        elif not self.wants_armed and self.phase in {"arming", "armed"}:
            self._disarm()
        elif not self.wants_armed and self.phase == "disabled":
            self.settle()
        elif self.throttle and self.phase == "armed" and self.interlock():
            self._obey(self.throttle[-1])
        elif self.throttle and not math.isfinite(self.throttle[-1]):
            self.report_refused(self._no_number(self.throttle[-1]), elapsed)
        else:
            self.continue_(elapsed)

    def settle(self) -> None:
        """Arm if that is commanded, else wait, off."""
        if not self.wants_armed:
            self.passivate("off")
        elif self.interlock():
            self._begin_arming()
        else:
            self.hold_disabled()

    def drive_on(self) -> None:
        """Go on from arming; poll the chip, and the interlock, while armed."""
        if self.phase == "arming":
            self.note_success()
            self._since_throttle = 0
        else:
            self.since_poll += self.sigma
            self._since_throttle += self.sigma
        self._stay_armed()

    def poll(self) -> None:
        """Check that the chip is as set: reset, it pulses no more."""
        self.chip.poll()

    def write_stop(self) -> None:
        """Low pulse first, then no signal at all; that alone to a chip that takes no duties."""
        try:
            if self.chip.is_running:
                self._set_throttle(0.0)
        finally:
            self.chip.stop_all()

    def exit(self) -> None:
        """Leave all sixteen channels full-off, at once."""
        self.chip.stop_all()

    def fail(self, error: HalError) -> None:
        """Disarm and stop; after a fault only a new command arms."""
        self.wants_armed = False
        super().fail(error)

    # ---------------------------------------------------------------------------------------------

    def _no_number(self, throttle: float) -> HalError:
        return HalError(f"throttle {throttle}", where=self.path, expected="a number from 0 to 1")

    def _begin_arming(self) -> None:
        try:
            self.chip.poll()
            self._set_throttle(0.0)
        except HalError as error:
            self.fail(error)
        else:
            self.since_poll = 0
            self.hold_after_transfer("arming", self.settings.arming)

    def _disarm(self) -> None:
        self.wants_armed = False
        self.stop()

    def _obey(self, throttle: float) -> None:
        if not math.isfinite(throttle):
            self.fail(self._no_number(throttle))
            return
        self._since_throttle = 0
        within = max(0.0, min(1.0, throttle))
        try:
            self._set_throttle(within)
        except HalError as error:
            self.fail(error)
        else:
            self.applied = Applied.ALL if within == throttle else Applied.PART
            self._stay_armed()

    def _stay_armed(self) -> None:
        """Stay so while outputs are enabled: an ESC goes on by itself, so this is checked here."""
        until_late = self.settings.timeout - self._since_throttle
        if until_late <= 0:
            timeout_s = self.settings.timeout / SECOND
            self.fail(HalError(f"no throttle for {timeout_s:g} s; disarmed", where=self.path))
            return
        try:
            self.poll_if_due()
        except HalError as error:
            self.fail(error)
            return
        if self.interlock():
            until_poll, period = POLL_EVERY - self.since_poll, poll_period(self.interlock)
            until_check = until_poll if period == NEVER else period
            self.hold_applying("armed", min(until_check, until_late))
        else:
            self.stop()

    def _set_throttle(self, throttle: float) -> None:
        low, high = self.settings.low_pulse_us, self.settings.high_pulse_us
        pulse_us = low + throttle * (high - low)
        duty = pulse_us * 1e-6 * self.chip.frequency_hz
        self.chip.set_duties(self.settings.channel, (duty,))
