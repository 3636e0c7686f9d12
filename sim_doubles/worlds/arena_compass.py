"""A compass in the arena: what the chip shows the way it is mounted, with noise."""

import math
from collections.abc import Callable
from typing import Final, TypeAlias

from sim_doubles.worlds.arena_parameters import CompassMounting
from sim_doubles.worlds.noise import InstantNoise

__all__ = ["Compass", "Direction"]

Direction: TypeAlias = Callable[[int], float]
"""Where the compass points at an instant, in rad anticlockwise from east."""

_SENSE: Final = {"upright": 1.0, "inverted": -1.0}


class Compass:
    """Shows bearings from north, 0 to 360 degrees."""

    def __init__(
        self,
        direction: Direction,
        noise: InstantNoise,
        *,
        mounting: CompassMounting,
        offset_deg: float,
    ) -> None:
        self._direction = direction
        self._noise = noise
        self._sense = _SENSE[mounting]
        self._offset_deg = offset_deg

    def bearing_deg(self, at: int) -> float:
        """What it shows at an instant."""
        true_deg = 90.0 - math.degrees(self._direction(at))
        return (self._sense * true_deg + self._offset_deg + self._noise.at(at)[0]) % 360.0
