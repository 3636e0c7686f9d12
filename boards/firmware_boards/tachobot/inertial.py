"""Puts together what the estimator needs to know of an instant: acceleration and attitude."""

from firmware_drivers.chips.mpu9250_burst import InertialSample

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.position_fix import PlanarInertial


class Inertial(Atomic):
    """Answers every yaw with the acceleration of the sample that it was made of.

    waiting --sample?--> waiting --yaw?--> sending (0) --inertial!--> waiting
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.yaw = self.in_port("yaw", Motion)
        self.inertial = self.out_port("inertial", PlanarInertial)
        self._level = (0.0, 0.0)
        self._motion = Motion(0.0, 0.0)

    def output(self) -> None:
        """Send both."""
        self.inertial.send(PlanarInertial(*self._level, *self._motion))

    def internal(self) -> None:
        """Wait for the next sample."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Keep the sample; its yaw is answered."""
        if self.sample:
            self._level = self.sample[-1].acceleration[:2]
        if self.yaw:
            self._motion = self.yaw[-1]
            self.activate("sending")
        else:
            self.continue_(elapsed)
