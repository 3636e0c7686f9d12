"""How far the robot leans: the gyro's rate integrated, slowly pulled to where gravity points."""

from typing import Final

from firmware_drivers.chips.mpu9250_burst import InertialSample

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Motion
from firmware_runtime.system.elementary import atan2

AT_REST: Final = 10
"""So many times as fast is the pull of gravity while the robot lies: no motor accelerates it."""


class Tilt(Atomic):
    """Turns every sample into pitch (rad, forward positive) and its rate, at the same instant.

    waiting --sample?--> estimating (0) --pitch! upright!--> waiting

    `upright` is sent when it changes: 1 within the limit, 0 beyond it. Beyond it the pitch goes to
    where gravity points AT_REST times as fast: one that a sensor has led astray would pass through
    upright on its way back, and be wrong when the robot is raised.
    """

    def __init__(self, name: str, time_constant: int, upright_rad: float) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.pitch = self.out_port("pitch", Motion)
        self.upright = self.out_port("upright", int)
        self.time_constant = time_constant
        self.upright_rad = upright_rad
        self.motion: Motion | None = None
        self.is_upright: bool | None = None
        self._has_changed = False
        self._since_sample = 0

    def output(self) -> None:
        """Send the estimate, and whether the robot is upright where that is new."""
        if self.motion is not None:
            self.pitch.send(self.motion)
        if self._has_changed:
            self.upright.send(int(bool(self.is_upright)))

    def internal(self) -> None:
        """Wait for the next sample."""
        self._has_changed = False
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take the newest sample in."""
        self._since_sample += elapsed
        self.motion = self._estimate(self.sample[-1], self._since_sample)
        self._since_sample = 0
        is_upright = abs(self.motion.position) <= self.upright_rad
        self._has_changed = is_upright != self.is_upright
        self.is_upright = is_upright
        self.activate("estimating")

    def _estimate(self, sample: InertialSample, elapsed: int) -> Motion:
        along, _, up = sample.acceleration
        by_gravity, rate = atan2(-along, up), sample.rate[1]
        if self.motion is None:
            return Motion(by_gravity, rate)
        pitch = self.motion.position + (self.motion.rate + rate) / 2 * elapsed / SECOND
        constant = self.time_constant if self.is_upright else self.time_constant / AT_REST
        share = min(1.0, elapsed / constant)
        return Motion(pitch + share * (by_gravity - pitch), rate)
