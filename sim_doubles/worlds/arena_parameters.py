"""The arena in numbers: what stands in it, the vehicle, its radar, its sonars and its compasses."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal, get_args

from sim_doubles.worlds.arena_geometry import Circle, Point, Shape, Wall
from sim_doubles.worlds.number_faults import number_faults

__all__ = ["ArenaParameters", "CompassMounting"]

CompassMounting = Literal["inverted", "upright"]
"""Inverted, a compass lies on its face: its angles grow anticlockwise seen from above."""

Solver = Literal["exact", "qss2"]
"""The vehicle's motion in closed form, or as a DEVS model of quantized integrators."""

_POSITIVE: Final = (
    "target_radius_m",
    "wheel_radius_m",
    "track_width_m",
    "body_radius_m",
    "head_speed_deg_s",
    "sonar_farthest_m",
)
_NOT_NEGATIVE: Final = ("head_limit_deg", "sonar_nearest_m", "compass_noise_deg")
_FINITE: Final = (
    "start_bearing_deg",
    "head_start_deg",
    "radar_compass_offset_deg",
    "body_compass_offset_deg",
)
_BETWEEN: Final = {
    "right_slip": (0.0, 0.9),
    "left_slip": (0.0, 0.9),
    "slip_std": (0.0, 0.1),
    "radar_half_angle_deg": (0.1, 80.0),
    "body_half_angle_deg": (0.1, 80.0),
}


@dataclass(frozen=True)
class ArenaParameters:
    """The numbers of the world: lengths in m, x east, y north; angles in degrees.

    Bearings count clockwise from north. Raises ValueError with every fault found.
    """

    target: tuple[float, float] = (2.0, 1.0)
    """Centre of what the robot looks for, a circle."""
    target_radius_m: float = 0.10
    obstacles: tuple[tuple[float, float, float], ...] = ()
    """Further circles: x, y, radius."""
    walls: tuple[tuple[float, float, float, float], ...] = ()
    """Straight walls: x and y of one end, x and y of the other."""
    low_obstacles: tuple[tuple[float, float, float], ...] = ()
    """Circles that stop the vehicle and echo to its body's sonar; the radar looks over them."""
    low_walls: tuple[tuple[float, float, float, float], ...] = ()
    """Walls of that kind."""
    start: tuple[float, float] = (0.0, 0.0)
    """Where the vehicle's centre stands at first."""
    start_bearing_deg: float = 0.0
    """Where it heads at first."""

    wheel_radius_m: float = 0.05
    track_width_m: float = 0.25
    """From the middle of one tread to that of the other."""
    body_radius_m: float = 0.15
    """The vehicle is a circle round the middle between its treads; its sonar sits on its front."""
    right_slip: float = 0.0
    """Share of its way that the right tread loses."""
    left_slip: float = 0.0
    slip_std: float = 0.0
    """Standard deviation of what either tread loses more, or less: the seed draws it, once."""

    head_speed_deg_s: float = 60.0
    """How fast the radar's head turns at full voltage."""
    head_limit_deg: float = 90.0
    """Where its end stops are, to either side of straight ahead; only at 180 it looks behind."""
    head_start_deg: float = 0.0
    """Where it looks at first, to the left of straight ahead."""
    radar_half_angle_deg: float = 3.0
    """Half the width of the radar sonar's beam."""
    body_half_angle_deg: float = 25.0
    """Half the width of the body sonar's beam."""
    sonar_nearest_m: float = 0.03
    """Echoes from nearer than this are not received."""
    sonar_farthest_m: float = 6.0
    """Echoes from farther than this are not received."""

    compass_mounting: CompassMounting = "inverted"
    """How both compasses are mounted."""
    compass_noise_deg: float = 0.3
    """Standard deviation of the white noise on each bearing."""
    radar_compass_offset_deg: float = 0.0
    """What the radar's compass shows too much."""
    body_compass_offset_deg: float = 0.0
    seed: int = 1
    """Chooses the noise and the slip."""
    solver: Solver = "exact"

    def __post_init__(self) -> None:
        numbers = number_faults(
            self, positive=_POSITIVE, not_negative=_NOT_NEGATIVE, finite=_FINITE
        )
        faults = [*numbers, *self._choice_faults(), *self._place_faults()]
        faults += [] if faults else self._start_faults()
        if faults:
            raise ValueError(f"arena: {'; '.join(faults)}")

    @cached_property
    def circles(self) -> tuple[Circle, ...]:
        """The target, then the obstacles."""
        obstacles = (Circle(*obstacle) for obstacle in self.obstacles)
        return (Circle(*self.target, self.target_radius_m), *obstacles)

    @cached_property
    def tall(self) -> tuple[Shape, ...]:
        """What the radar sees: circles, then walls."""
        return (*self.circles, *(Wall(*wall) for wall in self.walls))

    @cached_property
    def low(self) -> tuple[Shape, ...]:
        """What it looks over: circles, then walls."""
        circles = (Circle(*each) for each in self.low_obstacles)
        return (*circles, *(Wall(*wall) for wall in self.low_walls))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Everything that stands about, what is low last."""
        return (*self.tall, *self.low)

    def clearance_m(self, centre: Point) -> float:
        """How far the vehicle could move from there in any direction without touching anything."""
        return min(shape.distance(*centre) for shape in self.shapes) - self.body_radius_m

    def _choice_faults(self) -> Iterator[str]:
        for name, (least, most) in _BETWEEN.items():
            if not least <= getattr(self, name) <= most:
                yield f"{name} is {getattr(self, name)}, expected {least:g} to {most:g}"
        if abs(self.head_start_deg) > self.head_limit_deg:
            yield (
                f"head_start_deg is {self.head_start_deg}, expected a place between the end stops "
                f"at {self.head_limit_deg} to either side"
            )
        if not self.sonar_nearest_m < self.sonar_farthest_m:
            yield (
                f"sonar_farthest_m is {self.sonar_farthest_m}, expected more than "
                f"sonar_nearest_m, which is {self.sonar_nearest_m}"
            )
        if self.solver not in get_args(Solver):
            yield f"solver is {self.solver!r}, expected one of {get_args(Solver)}"
        if self.compass_mounting not in get_args(CompassMounting):
            choice = get_args(CompassMounting)
            yield f"compass_mounting is {self.compass_mounting!r}, expected one of {choice}"

    def _place_faults(self) -> Iterator[str]:
        for name in ("target", "start"):
            if not _are_finite(getattr(self, name), 2):
                yield f"{name} is {getattr(self, name)}, expected finite x and y"
        for each in (*self.obstacles, *self.low_obstacles):
            if not _are_finite(each, 3) or each[2] <= 0.0:
                yield f"obstacle {each}: expected finite x and y, and a radius above 0"
        for wall in (*self.walls, *self.low_walls):
            if not _are_finite(wall, 4) or tuple(wall[:2]) == tuple(wall[2:]):
                yield f"wall {wall}: expected finite x and y of two different ends"

    def _start_faults(self) -> Iterator[str]:
        clearance_m = self.clearance_m(self.start)
        if clearance_m <= 0.0:
            yield (
                f"start is {self.start}, expected a place where the vehicle, of radius "
                f"{self.body_radius_m} m, touches nothing"
            )


def _are_finite(numbers: tuple[float, ...], count: int) -> bool:
    return len(numbers) == count and all(map(math.isfinite, numbers))
