"""A compass in the arena: what the chip shows the way it is mounted, with noise and faults."""

import math
from collections.abc import Callable
from typing import Final, TypeAlias

from firmware_runtime.devs.time import NEVER, seconds
from sim_doubles.worlds.arena_parameters import CompassMounting
from sim_doubles.worlds.noise import InstantNoise

__all__ = ["Compass", "Direction"]

Direction: TypeAlias = Callable[[int], float]
"""Where the compass points at an instant, in rad anticlockwise from east."""

_SENSE: Final = {"upright": 1.0, "inverted": -1.0}


class Compass:
    """Shows bearings from north, 0 to 360 degrees, and from `stuck_s` on the one it showed then."""

    def __init__(
        self,
        direction: Direction,
        noise: InstantNoise,
        *,
        mounting: CompassMounting,
        offset_deg: float,
        stuck_s: float,
    ) -> None:
        self._direction = direction
        self._noise = noise
        self._sense = _SENSE[mounting]
        self._offset_deg = offset_deg
        self._stuck_at = NEVER if stuck_s == math.inf else seconds(stuck_s)
        self._stuck_deg: float | None = None

    def bearing_deg(self, at: int) -> float:
        """What it shows at an instant."""
        if at < self._stuck_at:
            return self._measured(at)
        if self._stuck_deg is None:
            self._stuck_deg = self._measured(self._stuck_at)
        return self._stuck_deg

    def _measured(self, at: int) -> float:
        true_deg = 90.0 - math.degrees(self._direction(at))
        return (self._sense * true_deg + self._offset_deg + self._noise.at(at)[0]) % 360.0
