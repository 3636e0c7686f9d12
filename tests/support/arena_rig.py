"""An arena driven by hand: two motors with ramps, a head, and orders at instants."""

from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.chips.motor_pair import MotorPair
from sim_doubles.worlds.arena import Arena, ArenaParameters

FULL_SCALE = 127
FULL_SPEED_RAD_S = 17.8
M_PER_UNIT_S = FULL_SPEED_RAD_S / FULL_SCALE * 0.05
"""Speed of a tread for one unit of its motor, with the wheels the parameters have by default."""


class ArenaRig:
    """Motor 1 is the right one. Orders jump unless a step is given, each 25 ms then."""

    def __init__(self, parameters: ArenaParameters | None = None) -> None:
        self.now = 0
        self.share = 0.0
        self.motors = MotorPair(0, FULL_SCALE, FULL_SPEED_RAD_S)
        self.arena = Arena(
            ArenaParameters() if parameters is None else parameters,
            wheel_angles=self.motors.turned_rad,
            wheels_change_at=self.motors.next_change_at,
            head_drive=lambda: self.share,
        )
        self.motors.before_change = lambda: self.arena.advance(self.now)

    def drive(self, at: int, right: int, left: int, step: int = 0) -> None:
        """Order speeds in units of the motors."""
        self.now = at
        period = 25 * MILLISECOND if step else 0
        self.motors.drive(at, (right, left), step or FULL_SCALE, period)

    def turn_head(self, at: int, share: float) -> None:
        """Order a share of full voltage, positive clockwise."""
        self.now = at
        self.arena.advance(at)
        self.share = share
