"""The light, and what four photocells on the head make of it: the plant behind the doubles."""

import math
from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND, seconds
from pan_tilt.settings import WorldTable

SUPPLY_V = 3.3
AMBIENT_V = 0.05
SQUINT_RAD = 0.35
"""How far each photocell looks away from where the head does: left, right, up, down."""
SQUINTS = ((SQUINT_RAD, 0.0), (-SQUINT_RAD, 0.0), (0.0, SQUINT_RAD), (0.0, -SQUINT_RAD))


class Light:
    """A lamp that swings from side to side, and shines for a while."""

    def __init__(self, settings: WorldTable) -> None:
        self._settings = settings
        self._from, self._until = seconds(settings.shines_from_s), seconds(settings.shines_until_s)

    def shines(self, at: int) -> bool:
        """Whether it is on at an instant, ns."""
        return self._from <= at < self._until

    def direction(self, at: int) -> tuple[float, float]:
        """Azimuth and elevation at an instant, rad."""
        given = self._settings
        swing = given.swing_rad * math.sin(math.tau * at / SECOND / given.swing_s)
        return given.azimuth_rad + swing, given.elevation_rad

    def voltages(self, at: int, pan_rad: float, tilt_rad: float) -> list[float]:
        """What the photocells give, V: by the cosine between their sight and the light, squared."""
        if not self.shines(at):
            return [AMBIENT_V] * len(SQUINTS)
        azimuth, elevation = self.direction(at)
        found = []
        for aside, above in SQUINTS:
            cosine = _cosine(azimuth, elevation, pan_rad + aside, tilt_rad + above)
            found.append(AMBIENT_V + (SUPPLY_V - AMBIENT_V) * max(0.0, cosine) ** 2)
        return found

    def error(self, at: int, pan_rad: float, tilt_rad: float) -> float:
        """The angle between where the head looks and the light, rad."""
        azimuth, elevation = self.direction(at)
        return math.acos(min(1.0, _cosine(azimuth, elevation, pan_rad, tilt_rad)))


def _cosine(azimuth: float, elevation: float, pan: float, tilt: float) -> float:
    """Of the angle between two directions."""
    level = math.cos(elevation) * math.cos(tilt) * math.cos(azimuth - pan)
    return level + math.sin(elevation) * math.sin(tilt)


class Probe(Atomic):
    """Shows the world in a trace.

    waiting --tick?--> showing (0) --error_rad! pan_rad!--> waiting
    """

    def __init__(self, look: Callable[[], tuple[float, float]]) -> None:
        super().__init__("world")
        self.tick = self.in_port("tick", object)
        self.error_rad = self.out_port("error_rad", float)
        self.pan_rad = self.out_port("pan_rad", float)
        self._look = look
        self._found = (0.0, 0.0)

    def output(self) -> None:
        """Send how far beside the light the head looks, and its pan, in rad."""
        self.error_rad.send(self._found[0])
        self.pan_rad.send(self._found[1])

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- the world has its own clock
        """Look at the world now."""
        self._found = self._look()
        self.activate("showing")
