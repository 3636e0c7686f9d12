"""Which pitch keeps the robot where it is: it leans against its own speed and its way."""

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Applied

SMOOTHING_S = 0.2
"""Time constant over which the drive is averaged: it is the speed that the motors hold."""


class Lean(Atomic):
    """Answers every drive with the pitch to hold from now on, rad.

    waiting --drive?, begin?--> leaning (0) --pitch_rad!--> waiting

    There is no encoder: the mean drive stands for the speed, and its integral for the way, as far
    as the motors apply it. Both begin again when balancing begins. `place` is where to stand from
    now on, m from there.
    """

    def __init__(
        self, name: str, per_speed_rad: float, per_place_rad_s: float, full_speed_m_s: float
    ) -> None:
        super().__init__(name)
        self.drive = self.in_port("drive", float)
        self.begin = self.in_port("begin", int)
        self.place_in = self.in_port("place", float)
        self.applied_in = self.in_port("applied", Applied)
        self.pitch_out = self.out_port("pitch_rad", float)
        self.per_speed_rad = per_speed_rad
        self.per_place_rad_s = per_place_rad_s
        self.speed = 0.0
        """Share of full speed."""
        self.place_s = 0.0
        """Seconds of full speed."""
        self.full_speed_m_s = full_speed_m_s
        self.reference_m = 0.0
        self.applied = Applied.ALL
        self._since_drive = 0

    def output(self) -> None:
        """Send the pitch."""
        beyond_s = self.place_s - self.reference_m / self.full_speed_m_s
        self.pitch_out.send(-(self.per_speed_rad * self.speed + self.per_place_rad_s * beyond_s))

    def internal(self) -> None:
        """Wait for the next drive."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Average the drive and add up the way."""
        self._since_drive += elapsed
        if self.begin:
            self.speed = self.place_s = 0.0
            self._since_drive = 0  # it lay meanwhile
        if self.place_in:
            self.reference_m = self.place_in[-1]
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.drive:
            self._go_on(self.drive[-1] if self.applied is not Applied.NOTHING else 0.0)
        if self.drive or self.begin:
            self.activate("leaning")
        else:
            self.continue_(elapsed)

    def _go_on(self, drive: float) -> None:
        seconds, self._since_drive = self._since_drive / SECOND, 0
        self.speed += (drive - self.speed) * min(1.0, seconds / SMOOTHING_S)
        self.place_s += self.speed * seconds
