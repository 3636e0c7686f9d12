"""The arena the detective robot drives in: its treads and radar motor move it, its sensors see it.

The world is a plane, x east and y north, in m. Inside, angles are in rad and anticlockwise from
east; outside, bearings are in degrees from north. The vehicle turns about the middle between its
treads (`arena_vehicle`); there stands the axis of the radar's head (`arena_head`) with one sonar
and one compass, the other two are on the body, its sonar at the very front. The target is a circle,
more circles and walls may stand about; all of them echo and all of them stop the vehicle. The radar
sits high: what is low it looks over, and only the body's sonar finds it.

**Which way angles grow.** In Figure 6 of the paper the right tread on 1 (clockwise) and the left on
2 make the compass angle grow. Signal 1 drives a tread forward, so that turns the vehicle
anticlockwise seen from above, and an ordinary compass, whose angles grow clockwise, would fall.
Here both compasses are therefore mounted `inverted`, on their faces: north is 0, west 90, and they
grow as in the figure. With `compass_mounting` `upright` east is 90; then the driver must be given
that headings count `counterclockwise`. A driver that turns the sense and an inverted mounting undo
each other: the robot would turn the longer way.

Nothing runs in the background. When a sensor is read, the world at that instant is a formula of
what the motors have done. `advance` is called just before the wheels or the head get another
command; what motors do by themselves (ramps, a timeout) `wheels_change_at` foretells. So how often
it is read does not matter, and the same seed gives the same values. The past is remembered: a
sensor that pings on its own may ask late.

Not modelled: inertia and skidding beyond a lost share of the way, a load that slows the motors,
pushing obstacles or driving off again after a contact, a target that moves, height and tilt, sound
that is weakened, takes time, glances off, is shadowed or received by the other sonar.
"""

import math
from collections.abc import Callable
from typing import Protocol

from sim_doubles.worlds.arena_geometry import Beam, Shape
from sim_doubles.worlds.arena_head import HeadDrive, RadarHead, bridge_drive
from sim_doubles.worlds.arena_parameters import ArenaParameters, CompassMounting
from sim_doubles.worlds.arena_vehicle import Pose, Vehicle, WheelAngles, WheelsChangeAt
from sim_doubles.worlds.noise import InstantNoise

__all__ = ["Arena", "ArenaParameters", "CompassMounting", "Pose", "bridge_drive"]


class Arena:
    """The world behind the detective robot's doubles, everything at rest at instant 0.

    `wheel_angles` gives how far the right and the left wheel have turned forward, in rad;
    `wheels_change_at` when their speeds change next; `head_drive` the share of full voltage at the
    radar's motor, positive clockwise. Instants are ns; no instant may be read before the chips
    have come to it.
    """

    def __init__(
        self,
        parameters: ArenaParameters,
        *,
        wheel_angles: WheelAngles,
        wheels_change_at: WheelsChangeAt,
        head_drive: HeadDrive,
    ) -> None:
        self.parameters = parameters
        self._vehicle = _vehicle_of(parameters)(parameters, wheel_angles, wheels_change_at)
        self._head = RadarHead(parameters, head_drive)
        self._sense = 1.0 if parameters.compass_mounting == "upright" else -1.0
        self._radar_noise, self._body_noise = (
            InstantNoise(source, parameters.seed, parameters.compass_noise_deg)
            for source in ("radar compass", "body compass")
        )

    def advance(self, at: int) -> None:
        """Let new commands count from `at` on. Raises ValueError if a motion changed later."""
        self._vehicle.advance(at)
        self._head.advance(at)

    def push(self, at: int, turn_rad: float) -> None:
        """Turn the vehicle where it stands, at once, anticlockwise; something shoved it."""
        self._vehicle.push(at, turn_rad)

    def hold(self, at: int, *, is_held: bool) -> None:
        """Keep the vehicle where it stands from an instant on, or let go of it; its head turns."""
        self._vehicle.hold(at, is_held=is_held)

    # What is true

    def pose(self, at: int) -> Pose:
        """Return the vehicle's pose at `at`."""
        return self._vehicle.pose(at)

    def head_angle_rad(self, at: int) -> float:
        """Return the radar's angle at `at`, anticlockwise from the vehicle's heading."""
        return self._head.angle_rad(at)

    def distance_to_target(self, at: int) -> float:
        """Return the way from the vehicle's front, its sonar's place, to the target, m."""
        front = self.pose(at).ahead(self.parameters.body_radius_m)
        return max(0.0, self.parameters.circles[0].distance(*front))

    @property
    def collided(self) -> bool:
        """Return whether the vehicle has touched anything, up to the latest instant read."""
        return self._vehicle.collided

    # What the sensors get

    def radar_beam(self, at: int) -> Beam:
        """The beam of the sonar on the radar's head."""
        pose, half_angle = self.pose(at), math.radians(self.parameters.radar_half_angle_deg)
        return Beam(pose.x_m, pose.y_m, self._radar_direction_rad(at), half_angle)

    def body_beam(self, at: int) -> Beam:
        """The beam of the sonar on the vehicle's front."""
        pose, half_angle = self.pose(at), math.radians(self.parameters.body_half_angle_deg)
        return Beam(*pose.ahead(self.parameters.body_radius_m), pose.heading_rad, half_angle)

    def radar_echoes(self, at: int) -> list[float]:
        """Return distances of what is tall and echoes to the radar's sonar, m, nearest first."""
        return self._echoes(self.radar_beam(at), self.parameters.tall)

    def body_echoes(self, at: int) -> list[float]:
        """Return distances of what echoes to the body's sonar, m, nearest first."""
        return self._echoes(self.body_beam(at), self.parameters.shapes)

    def radar_bearing_deg(self, at: int) -> float:
        """Return what the compass on the radar's head shows, 0 to 360 degrees from north."""
        offset_deg, noise = self.parameters.radar_compass_offset_deg, self._radar_noise
        return self._shown_deg(self._radar_direction_rad(at), offset_deg, noise.at(at)[0])

    def body_bearing_deg(self, at: int) -> float:
        """Return what the compass on the body shows; likewise."""
        offset_deg, noise = self.parameters.body_compass_offset_deg, self._body_noise
        return self._shown_deg(self._vehicle.pose(at).heading_rad, offset_deg, noise.at(at)[0])

    # ---------------------------------------------------------------------------------------------

    def _shown_deg(self, direction_rad: float, offset_deg: float, noise_deg: float) -> float:
        """Return a bearing the way the compass is mounted."""
        true_deg = 90.0 - math.degrees(direction_rad)
        return (self._sense * true_deg + offset_deg + noise_deg) % 360.0

    def _radar_direction_rad(self, at: int) -> float:
        return self._vehicle.pose(at).heading_rad + self._head.angle_rad(at)

    def _echoes(self, beam: Beam, shapes: tuple[Shape, ...]) -> list[float]:
        nearest, farthest = self.parameters.sonar_nearest_m, self.parameters.sonar_farthest_m
        echoes = (shape.echo(beam) for shape in shapes)
        return sorted(echo for echo in echoes if nearest <= echo <= farthest)


class _Drives(Protocol):
    """Motion of the vehicle under its wheels."""

    @property
    def collided(self) -> bool:
        """Return whether it has touched anything."""

    def pose(self, at: int) -> Pose:
        """Return its pose at an instant, now or before."""

    def advance(self, at: int) -> None:
        """Let new commands count from an instant on."""

    def push(self, at: int, turn_rad: float) -> None:
        """Turn it where it stands, at once."""

    def hold(self, at: int, *, is_held: bool) -> None:
        """Keep it where it stands, or let go of it."""


def _vehicle_of(
    parameters: ArenaParameters,
) -> Callable[[ArenaParameters, WheelAngles, WheelsChangeAt], _Drives]:
    """The class of vehicle, by the way in which its motion is worked out."""
    if parameters.solver == "exact":
        return Vehicle
    from sim_doubles.worlds.arena_quantized import (  # noqa: PLC0415 -- few runs load its blocks
        QuantizedVehicle,
    )

    return QuantizedVehicle
