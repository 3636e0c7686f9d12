"""Where TachoBot points: the gyro's rate integrated, slowly pulled to the compass."""

import math

from drivers.chips.mpu9250_burst import InertialSample
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.elementary import atan2
from firmware_runtime.models.motion import Motion

FIELDS_AVERAGED = 100
"""Readings of the compass from which its angle at yaw zero is taken; one alone is too noisy."""


class Attitude(Atomic):
    """Turns every inertial sample into yaw (rad) and yaw rate (rad/s), at the same instant.

    disabled --enable? true--> waiting --sample?--> estimating (0) --yaw!--> waiting
    waiting --enable? false--> disabled

    Disabled again, it goes on estimating and says nothing: the robot may turn meanwhile.

    Yaw is zero where the first sample found the robot and counts anticlockwise seen from above.
    Rates are integrated by the trapezoid rule over the time that really passed. The compass gives
    how far the estimate has strayed from it since the start, on average of its first fields; of
    that, elapsed / time constant is taken off in one step.
    """

    def __init__(self, name: str, compass_time_constant: int, *, enabled: bool) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.enable = self.in_port("enable", bool)
        self.yaw = self.out_port("yaw", Motion)
        self.compass_time_constant = compass_time_constant
        self.enabled = enabled
        self.motion: Motion | None = None
        self._since_sample = 0
        self._headings = 0
        self._heading_at_zero = 0.0

    def initialize(self) -> None:
        """Wait for a sample, or to be enabled."""
        self.passivate("waiting" if self.enabled else "disabled")

    def output(self) -> None:
        """Send the estimate."""
        if self.motion is not None:
            self.yaw.send(self.motion)

    def internal(self) -> None:
        """Wait for the next sample."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take the newest sample in, if enabled."""
        self._since_sample += elapsed
        if self.enable:
            self.enabled = self.enable[-1]
        has_begun = self.enabled or self.motion is not None
        if self.sample and has_begun:
            self.motion = self._estimate(self.sample[-1], self._since_sample)
            self._since_sample = 0
        if not self.enabled:
            self.passivate("disabled")
        elif self.sample:
            self.activate("estimating")
        else:
            self.passivate("waiting")

    def _estimate(self, sample: InertialSample, elapsed: int) -> Motion:
        rate, field = sample.rate[2], sample.field
        if self.motion is None:
            return Motion(0.0, rate)
        yaw, rate_before = self.motion
        yaw += (rate_before + rate) / 2 * elapsed / SECOND
        if field is not None and self.compass_time_constant:
            constant = self.compass_time_constant
            share = elapsed / constant if elapsed < constant else 1.0
            yaw += share * self._compass_error(field, yaw)
        return Motion(yaw, rate)

    def _compass_error(self, field: tuple[float, float, float], yaw: float) -> float:
        """How far the compass stands from the estimate, within plus and minus pi; 0 at first."""
        heading = atan2(-field[1], field[0])
        error = math.remainder(heading - self._heading_at_zero - yaw, math.tau)
        if self._headings == FIELDS_AVERAGED:
            return error
        self._headings += 1
        self._heading_at_zero += error / self._headings
        return 0.0
