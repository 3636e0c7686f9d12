"""The arena's numbers as shapes, checked: what stands in it, and where the vehicle starts."""

import math
from collections.abc import Iterator
from functools import cached_property

from firmware_boards.detective.arena_table import ArenaTable, CompassMounting

from sim_doubles.worlds.arena_geometry import Circle, Point, Shape, Wall

__all__ = ["ArenaParameters", "CompassMounting"]


class ArenaParameters(ArenaTable, frozen=True, dict=True):
    """The numbers of the world; each is in its range. Raises ValueError with every other fault."""

    def __post_init__(self) -> None:
        faults = [*self._choice_faults(), *self._place_faults()]
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
        """Return the obstacles that the radar sees: circles, then walls."""
        return (*self.circles, *(Wall(*wall) for wall in self.walls))

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Everything that stands about, what is low last."""
        low = (Circle(*each) for each in self.low_obstacles)
        return (*self.tall, *low, *(Wall(*wall) for wall in self.low_walls))

    def clearance_m(self, centre: Point) -> float:
        """Return how far the vehicle could move from there in any direction and touch nothing."""
        return min(shape.distance(*centre) for shape in self.shapes) - self.body_radius_m

    def _choice_faults(self) -> Iterator[str]:
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

    def _place_faults(self) -> Iterator[str]:
        for name in ("target", "start"):
            if not all(map(math.isfinite, getattr(self, name))):
                yield f"{name} is {getattr(self, name)}, expected finite x and y"
        for each in (*self.obstacles, *self.low_obstacles):
            if not all(map(math.isfinite, each)) or each[2] <= 0.0:
                yield f"obstacle {each}: expected finite x and y, and a radius above 0"
        for wall in (*self.walls, *self.low_walls):
            if not all(map(math.isfinite, wall)) or wall[:2] == wall[2:]:
                yield f"wall {wall}: expected finite x and y of two different ends"

    def _start_faults(self) -> Iterator[str]:
        if self.clearance_m(self.start) <= 0.0:
            yield (
                f"start is {self.start}, expected a place where the vehicle, of radius "
                f"{self.body_radius_m} m, touches nothing"
            )
