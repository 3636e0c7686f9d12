"""The electronic speed controller of the central propeller, on one channel of a PCA9685.

An ESC takes pulses of about 1000 to 2000 us and refuses to turn until it has seen the low one for
some seconds. Full-off is "no signal": the ESC stops by itself and must be armed anew.
"""

import math
from dataclasses import dataclass

from drivers.chips.pca9685 import LOOK_EVERY_NS, Pca9685
from drivers.hardware import HardwareModel
from firmware_runtime.hal.errors import HalError, NotReady
from firmware_runtime.hal.interlock import POLL_PERIOD, Interlock, always_enabled

STOP_AGAIN_AFTER = 10_000_000
"""Ns until a stop that nobody acknowledged is written again."""


@dataclass(frozen=True, slots=True)
class EscSettings:
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


class Esc(HardwareModel):
    """Obeys `throttle` (0 to 1) once armed; `armed` tells when it is and when it no longer is.

    bring_up (the steps' waits) --> off;  a step failed --fault!--> bring_up (RETRY_AFTER)
    off --arm? true--> arming (settings.arming) --armed! true--> armed --throttle?--> armed
    arming, armed --arm? false--> reporting (0) --armed! false--> off
    arming, armed, chip silent or throttle not a number --> reporting --armed! false, fault!--> off
    reporting, not stopped yet --> stopping (STOP_AGAIN_AFTER) --> reporting
    armed, the chip was reset --> reporting --armed! false, fault!--> bring_up
    off, to be armed without leave --> forbidden (POLL_PERIOD), given leave --> arming
    armed, without leave --> reporting --armed! false--> forbidden

    An `arm` that comes during the bring-up, or while the interlock disables outputs, is kept.
    """

    def __init__(
        self, name: str, chip: Pca9685, settings: EscSettings, interlock: Interlock = always_enabled
    ) -> None:
        super().__init__(name, lambda: chip.bring_up(settings.frequency_hz), chip.line)
        self.arm = self.in_port("arm", bool)
        self.throttle = self.in_port("throttle", float)
        self.armed_out = self.out_port("armed", bool)
        self.chip = chip
        self.settings = settings
        self.interlock = interlock
        self.wants_armed = False
        self.is_stopped = True
        self._since_look = 0
        self._is_bring_up_due = False

    def begin(self) -> None:
        """Arm if that was ordered meanwhile, else wait, off."""
        self._is_bring_up_due = False
        if self.wants_armed:
            self._begin_arming()
        else:
            self.passivate("off")

    def output(self) -> None:
        """Tell what changed: armed after arming, disarmed and why when reporting."""
        super().output()
        if self.phase == "arming":
            self.armed_out.send(True)
        elif self.phase == "reporting":
            self.armed_out.send(False)

    def proceed(self) -> None:
        """Go on from arming, or with a stop that was not acknowledged."""
        if self.phase == "forbidden":
            self._begin_arming()
        elif self.phase == "arming":
            self.consecutive_faults = 0
            self._stay_armed()
        elif self.phase == "armed":
            self._since_look += self.sigma
            self._look()
        elif self.phase == "stopping":
            self._stop()
        elif not self.is_stopped:
            self.hold_in("stopping", STOP_AGAIN_AFTER)
        elif self._is_bring_up_due:
            self.bring_up_again()
        elif self.wants_armed:
            self._begin_arming()
        else:
            self.passivate("off")

    def external(self, elapsed: int) -> None:
        """Arm or disarm; set the throttle if armed."""
        if self.phase == "armed":
            self._since_look += elapsed
        if self.arm:
            self.wants_armed = self.arm[-1]
        if self.phase.startswith("bring_up"):
            self.continue_(elapsed)
        elif self.wants_armed and self.phase == "off":
            self._begin_arming()
        elif not self.wants_armed and self.phase in {"arming", "armed"}:
            self._stop()
        elif not self.wants_armed and self.phase == "forbidden":
            self.passivate("off")
        elif self.throttle and self.phase == "armed" and self.interlock():
            self._obey(self.throttle[-1])
        else:
            self.continue_(elapsed)

    def exit(self) -> None:
        """Leave all sixteen channels full-off."""
        self.chip.stop_all()

    # ---------------------------------------------------------------------------------------------

    def _begin_arming(self) -> None:
        if not self.interlock():
            self.hold_in("forbidden", POLL_PERIOD)
            return
        try:
            self.chip.look()
            self._set_throttle(0.0)
        except HalError as error:
            self._fail(error)
        else:
            self._since_look = 0
            self.hold_after_transfer("arming", self.settings.arming)

    def _obey(self, throttle: float) -> None:
        if not math.isfinite(throttle):
            self._fail(HalError(f"{self.path}: throttle {throttle}, expected a number from 0 to 1"))
            return
        try:
            self._set_throttle(max(0.0, min(1.0, throttle)))
        except HalError as error:
            self._fail(error)
        else:
            self._look()

    def _look(self) -> None:
        """Stay armed on a chip that still is as brought up: one that was reset pulses no more."""
        if self._since_look >= LOOK_EVERY_NS:
            self._since_look = 0
            try:
                self.chip.look()
            except HalError as error:
                self._fail(error)
                return
        self._stay_armed()

    def _stay_armed(self) -> None:
        """Stay so while there is leave; an ESC told once goes on, so leave is asked for here."""
        if self.interlock():
            until_look = LOOK_EVERY_NS - self._since_look
            self.hold_in("armed", until_look if self.interlock is always_enabled else POLL_PERIOD)
        else:
            self._stop()
            self.wants_armed = True

    def _set_throttle(self, throttle: float) -> None:
        low, high = self.settings.low_pulse_us, self.settings.high_pulse_us
        pulse_us = low + throttle * (high - low)
        duty = pulse_us * 1e-6 * self.chip.frequency_hz
        self.is_stopped = False
        self.chip.set_duties(self.settings.channel, (duty,))

    def _stop(self) -> None:
        """Low pulse first, then no signal at all; that alone to a chip that takes no duties."""
        self.wants_armed = False
        try:
            if not self._is_bring_up_due:
                self._set_throttle(0.0)
            self.chip.stop_all()
        except HalError as error:
            self.is_stopped = False
            self.note(error)
        else:
            self.is_stopped = True
        self.activate("reporting")

    def _fail(self, error: HalError) -> None:
        self._is_bring_up_due = isinstance(error, NotReady)
        self._stop()
        self.note(error)
