"""The vehicle on two treads: from wheel angles to where it is, and whether it has hit anything.

While both wheels turn evenly the vehicle's centre follows an arc of a circle, in closed form. Arcs
are strung together where a wheel's speed changes and nowhere else, so how often its
position is read changes nothing. Arcs that have ended are remembered.

Contact is felt along the arc. The free space round a point is the distance the centre may go from
there in any direction; after that distance it is taken again, until there is none or the arc ends.
A vehicle that touches something stands there for good, its treads slipping.
"""

import math
from collections.abc import Callable
from typing import Final, NamedTuple, TypeAlias

from sim_doubles.worlds.arena_geometry import Point
from sim_doubles.worlds.arena_parameters import ArenaParameters
from sim_doubles.worlds.arena_past import Past, require_in_order
from sim_doubles.worlds.noise import InstantNoise

__all__ = ["Pose", "Vehicle", "WheelAngles", "WheelsChangeAt", "gears"]

WheelAngles: TypeAlias = Callable[[int], tuple[float, float]]
"""Angles by which the right and the left wheel have turned forward at an instant, in rad."""

WheelsChangeAt: TypeAlias = Callable[[int], int]
"""The first instant after an instant at which a wheel's speed changes, if no command comes."""

_CONTACT_M: Final = 1e-4
"""Free space less than this is contact."""


class Pose(NamedTuple):
    """Position of the centre, and heading: anticlockwise from east, whole turns included."""

    x_m: float
    y_m: float
    heading_rad: float

    def along(self, length_m: float, turn_rad: float) -> "Pose":
        """The pose at the end of an arc; it is as far off as its chord is long."""
        half = 0.5 * turn_rad
        chord = length_m * (math.sin(half) / half if half else 1.0)
        direction = self.heading_rad + half
        return Pose(
            self.x_m + chord * math.cos(direction),
            self.y_m + chord * math.sin(direction),
            self.heading_rad + turn_rad,
        )

    def ahead(self, distance_m: float) -> Point:
        """The point straight ahead of the centre."""
        front = self.along(distance_m, 0.0)
        return (front.x_m, front.y_m)


class _Arc(NamedTuple):
    """An even motion from one instant to another; contact may stop it after a share of it."""

    since: int
    until: int
    start: Pose
    length_m: float
    turn_rad: float
    free_share: float

    def pose(self, at: int) -> Pose:
        share = (at - self.since) / (self.until - self.since) if at > self.since else 0.0
        share = min(share, self.free_share)
        return self.start.along(share * self.length_m, share * self.turn_rad)


class Vehicle:
    """Stands at its start at instant 0; instants are ns."""

    def __init__(
        self,
        parameters: ArenaParameters,
        wheel_angles: WheelAngles,
        wheels_change_at: WheelsChangeAt,
    ) -> None:
        self._parameters = parameters
        self._wheel_angles = wheel_angles
        self._wheels_change_at = wheels_change_at
        self._right_m_per_rad, self._left_m_per_rad = gears(parameters)
        self._past: Past[_Arc] = Past()
        # The arc under way
        self._since = 0
        self._start = Pose(*parameters.start, math.radians(90.0 - parameters.start_bearing_deg))
        self._angles = wheel_angles(0)
        self._free_m = parameters.clearance_m(parameters.start)
        self._contact_m: float | None = None
        self._is_held = False

    @property
    def collided(self) -> bool:
        """Return whether it has touched anything, up to the latest instant read."""
        return self._contact_m is not None

    def pose(self, at: int) -> Pose:
        """Return its pose at an instant, now or before."""
        if at < self._since:
            return self._past.at(at).pose(at)
        self._go_on(at)
        return self._arc(at).pose(at)

    def advance(self, at: int) -> None:
        """Begin another arc at an instant. Raises ValueError if the last one began later."""
        require_in_order(at, self._since)
        self._go_on(at)
        self._end_arc(at)

    def push(self, at: int, turn_rad: float) -> None:
        """Turn it where it stands, at once."""
        self.advance(at)
        self._start = self._start.along(0.0, turn_rad)

    def hold(self, at: int, *, is_held: bool) -> None:
        """Keep it where it stands, its treads slipping, or let go of it."""
        self.advance(at)
        self._is_held = is_held

    def _go_on(self, at: int) -> None:
        """End every arc that ends by then because the motors change their speed by themselves."""
        while (change_at := self._wheels_change_at(self._since)) <= at:
            self._end_arc(change_at)

    def _end_arc(self, at: int) -> None:
        arc = self._arc(at)
        self._past.add(arc)
        self._since = at
        self._start = arc.pose(at)
        self._angles = self._wheel_angles(at)
        self._free_m -= abs(arc.length_m)
        self._contact_m = 0.0 if self.collided else None

    def _arc(self, at: int) -> _Arc:
        """The arc under way, up to an instant."""
        if self._is_held:
            return _Arc(self._since, at, self._start, 0.0, 0.0, 1.0)
        right, left = self._wheel_angles(at)
        right_m = (right - self._angles[0]) * self._right_m_per_rad
        left_m = (left - self._angles[1]) * self._left_m_per_rad
        length_m = 0.5 * (right_m + left_m)
        turn_rad = (right_m - left_m) / self._parameters.track_width_m
        free_share = self._free_share(length_m, turn_rad)
        return _Arc(self._since, at, self._start, length_m, turn_rad, free_share)

    def _free_share(self, length_m: float, turn_rad: float) -> float:
        """The share of the arc after which the vehicle touches something; 1 if it does not."""
        way_m = abs(length_m)
        while self._contact_m is None and self._free_m < way_m:
            share = self._free_m / way_m
            place = self._start.along(share * length_m, share * turn_rad)
            clearance_m = self._parameters.clearance_m((place.x_m, place.y_m))
            if clearance_m < _CONTACT_M:
                self._contact_m = self._free_m
            self._free_m += clearance_m
        if self._contact_m is None:
            return 1.0
        return self._contact_m / way_m if way_m else 0.0


def gears(parameters: ArenaParameters) -> tuple[float, float]:
    """The way of the right and of the left tread for each rad of their wheels."""
    more, less, _ = InstantNoise("slip", parameters.seed, parameters.slip_std).at(0)
    radius_m = parameters.wheel_radius_m
    right_m = radius_m * (1.0 - parameters.right_slip - more)
    return right_m, radius_m * (1.0 - parameters.left_slip - less)
