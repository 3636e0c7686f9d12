"""The radar's head: turns with the voltage of its motor, at once, between two end stops."""

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

from firmware_runtime.devs.time import SECOND
from sim_doubles.worlds.arena_parameters import ArenaParameters
from sim_doubles.worlds.arena_past import Past

__all__ = ["HeadDrive", "RadarHead", "bridge_drive"]

HeadDrive: TypeAlias = Callable[[], float]
"""The motor's share of full voltage now, -1 to 1; positive turns clockwise seen from above."""


def bridge_drive(pwm: float, in1: float, in2: float) -> float:
    """Return an H-bridge's mean voltage, as a share of full voltage, from its duties."""
    return pwm * (in1 - in2)


class _Turn(NamedTuple):
    """An even turn that goes on, up to an end stop."""

    since: int
    start_rad: float
    rate_rad_s: float
    limit_rad: float

    def angle_rad(self, at: int) -> float:
        angle = self.start_rad + self.rate_rad_s * (at - self.since) / SECOND
        return max(-self.limit_rad, min(self.limit_rad, angle))


class RadarHead:
    """Looks where it starts at instant 0; `advance` must be called before its drive changes."""

    def __init__(self, parameters: ArenaParameters, drive: HeadDrive) -> None:
        self._drive = drive
        self._speed_rad_s = math.radians(parameters.head_speed_deg_s)
        self._limit_rad = math.radians(parameters.head_limit_deg)
        self._past: Past[_Turn] = Past()
        self._since = 0
        self._start_rad = math.radians(parameters.head_start_deg)

    def angle_rad(self, at: int) -> float:
        """Return its angle at an instant, anticlockwise from the vehicle's heading.

        Raises ValueError if the drive is not from -1 to 1.
        """
        turn = self._turn() if at >= self._since else self._past.at(at)
        return turn.angle_rad(at)

    def advance(self, at: int) -> None:
        """Begin another turn at an instant, no earlier than the last."""
        turn = self._turn()
        self._past.add(turn)
        self._since, self._start_rad = at, turn.angle_rad(at)

    def _turn(self) -> _Turn:
        """The turn under way."""
        drive = self._drive()
        if not -1.0 <= drive <= 1.0:
            raise ValueError(f"arena: the head's drive is {drive}, expected -1 to 1")
        return _Turn(self._since, self._start_rad, -drive * self._speed_rad_s, self._limit_rad)
