"""The arena in numbers: what stands in it, the vehicle, its radar, its sonars, its compasses."""

from typing import Annotated, Literal, TypeAlias

from msgspec import Meta

from firmware_runtime.board.settings import NotNegative, Positive, SecondsOrNone, Settings

Slip: TypeAlias = Annotated[float, Meta(ge=0, le=0.9)]
HalfAngle: TypeAlias = Annotated[float, Meta(ge=0.1, le=80)]
CompassMounting: TypeAlias = Literal["inverted", "upright"]
"""Inverted, a compass lies on its face: its angles grow anticlockwise seen from above."""
Circle: TypeAlias = tuple[float, float, float]
"""x, y, radius."""
Wall: TypeAlias = tuple[float, float, float, float]
"""x and y of one end, x and y of the other."""


class ArenaTable(Settings, frozen=True):
    """The world behind the doubles, not used on the real robot's lines.

    Lengths in m, x east, y north; angles in degrees, bearings clockwise from north.
    """

    target: tuple[float, float] = (2.0, 1.0)
    """Centre of what the robot looks for, a circle."""
    target_radius_m: Positive = 0.10
    obstacles: tuple[Circle, ...] = ()
    """Further circles."""
    walls: tuple[Wall, ...] = ()
    start: tuple[float, float] = (0.0, 0.0)
    """The vehicle's centre at first."""
    start_bearing_deg: float = 0.0
    wheel_radius_m: Positive = 0.05
    track_width_m: Positive = 0.25
    """From the middle of one tread to that of the other."""
    body_radius_m: Positive = 0.15
    """The vehicle is a circle round the middle between its treads; its sonar sits on its front."""
    right_slip: Slip = 0.0
    """Share of its way that the right tread loses."""
    left_slip: Slip = 0.0
    slip_std: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    """Standard deviation of what either tread loses more, or less: the seed draws it, once."""
    head_speed_deg_s: Positive = 60.0
    """Speed of the radar's head at full voltage."""
    head_limit_deg: NotNegative = 90.0
    """Its end stops, to either side of straight ahead; only at 180 it looks behind."""
    head_start_deg: float = 0.0
    """Its angle at first, to the left of straight ahead."""
    radar_half_angle_deg: HalfAngle = 3.0
    """Half the width of the radar sonar's beam."""
    body_half_angle_deg: HalfAngle = 25.0
    sonar_nearest_m: NotNegative = 0.03
    """Echoes from nearer than this are not received."""
    sonar_farthest_m: Positive = 6.0
    compass_mounting: CompassMounting = "inverted"
    compass_noise_deg: NotNegative = 0.3
    """Standard deviation of the white noise on each bearing."""
    radar_compass_offset_deg: float = 0.0
    """Error of the radar's compass, clockwise."""
    body_compass_offset_deg: float = 0.0
    seed: Annotated[int, Meta(ge=0)] = 1
    """Chooses the noise and the slip."""
    solver: Literal["exact", "qss2"] = "exact"
    """The vehicle's motion in closed form, or as a DEVS model of quantized integrators."""
    radar_compass_stuck_s: SecondsOrNone | None = None
    """From when on it shows the same."""
    body_compass_stuck_s: SecondsOrNone | None = None
    low_obstacles: tuple[Circle, ...] = ()
    """Circles that stop the vehicle and echo to its body's sonar; the radar looks over them."""
    low_walls: tuple[Wall, ...] = ()
