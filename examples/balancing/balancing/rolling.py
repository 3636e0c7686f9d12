"""How the robot rolls, by its IMU and by its motors: a gyro that lies contradicts them.

Gravity alone does not: a robot that leans is balanced by rolling ever faster, and what its
accelerometer feels then points along its body, however far that leans. But how fast it rolls faster
is felt, if the pitch is right, and how fast it rolls is known by the voltage that its motors get.
"""

from typing import NamedTuple

from firmware_drivers.chips.mpu9250_burst import InertialSample

from balancing.settings import RollingCheckTable
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import seconds
from firmware_runtime.models.cross_check import CrossCheck, CrossCheckSettings, Source, Window
from firmware_runtime.models.motion import Applied, Motion
from firmware_runtime.system.elementary import cos_sin


class Roll(NamedTuple):
    """How the robot rolls, forward positive."""

    acceleration_m_s2: float
    """By its IMU, and the pitch that comes of it."""
    speed_m_s: float
    """By its motors, up to a constant."""


class Rolling(Atomic):
    """Answers every pitch with both, averaged over `smoothing` ns: motors need time to follow.

    waiting --pitch?--> sending (0) --roll!--> waiting

    A sample comes with its pitch, and the drive is the one since the last sample. The speed stands
    still while the robot does not balance, and for `settling` ns after it began: its motors push
    against a hand then.
    """

    def __init__(self, name: str, stated: RollingCheckTable, full_speed_m_s: float) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.pitch = self.in_port("pitch", Motion)
        self.drive = self.in_port("drive", float)
        self.balance = self.in_port("balance", int)
        self.applied_in = self.in_port("applied", Applied)
        self.roll_out = self.out_port("roll", Roll)
        self.smoothing = seconds(stated.smoothing_s)
        self.settling = seconds(stated.settling_s)
        self.full_speed_m_s = full_speed_m_s
        self.roll = Roll(0.0, 0.0)
        self.applied = Applied.ALL
        self._is_balancing = False
        self._drive = 0.0
        self._constant = 0.0
        self._averages = Roll(0.0, 0.0)
        """Since it balances: a drive that swings says little of the speed at any one instant."""
        self._acceleration: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self._since_pitch = 0
        self._balanced_for = 0

    def output(self) -> None:
        """Send both."""
        self.roll_out.send(self.roll)

    def internal(self) -> None:
        """Wait for the next sample."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take in what came; with a pitch go on."""
        self._since_pitch += elapsed
        if self.balance:
            self._is_balancing = self.balance[-1] == 1
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.drive:
            self._drive = self.drive[-1]
        if self.sample:
            self._acceleration = self.sample[-1].acceleration
        if self.pitch:
            self._go_on(self.pitch[-1].position, self._since_pitch)
            self._since_pitch = 0
            self.activate("sending")
        else:
            self.continue_(elapsed)

    def _go_on(self, pitch: float, elapsed: int) -> None:
        by_motors = self._drive * self.full_speed_m_s
        if not (self._is_balancing and self.applied is not Applied.NOTHING):
            self._balanced_for, self._averages = 0, Roll(0.0, 0.0)
            self.roll = Roll(0.0, self.roll.speed_m_s)
            return
        self._balanced_for += elapsed
        along, _, up = self._acceleration
        cosine, sine = cos_sin(pitch)
        share = min(1.0, elapsed / self.smoothing)
        acceleration, speed = self._averages
        acceleration += share * (along * cosine + up * sine - acceleration)
        speed += share * (by_motors - speed)
        self._averages = Roll(acceleration, speed)
        if self._balanced_for <= self.settling:
            self._constant = self.roll.speed_m_s - speed
            self.roll = Roll(0.0, self.roll.speed_m_s)
        else:
            self.roll = Roll(acceleration, speed + self._constant)


def rolling_check(stated: RollingCheckTable) -> CrossCheck[Roll, Roll]:
    """The IMU's roll against the motors'."""
    return CrossCheck(
        "rolling_check",
        CrossCheckSettings(
            quantity="speed (m/s, motors less IMU)",
            windows=(Window(seconds(stated.window_s), stated.tolerance_m_s),),
            share=stated.share,
        ),
        rate=Source(Roll, lambda roll: roll.acceleration_m_s2),
        value=Source(Roll, lambda roll: roll.speed_m_s),
    )
