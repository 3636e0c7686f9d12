"""Obstacles of the arena: circles and walls, and how a sonar's beam meets them.

A beam is a cone. What reflects is the nearest point of a surface inside it, whatever the surface's
slope: real sound glances off a smooth wall that is met at an angle.
"""

import math
from typing import NamedTuple, TypeAlias

__all__ = ["Beam", "Circle", "Point", "Shape", "Wall"]

Point: TypeAlias = tuple[float, float]
"""x east and y north, in m."""


class Beam(NamedTuple):
    """A cone from a point; its direction is anticlockwise from east, its half angle below 90."""

    x_m: float
    y_m: float
    direction_rad: float
    half_angle_rad: float

    def seen_from(self, x_m: float, y_m: float) -> Point:
        """The same point in the beam's axes: along it, and to the left of it."""
        dx, dy = x_m - self.x_m, y_m - self.y_m
        cosine, sine = math.cos(self.direction_rad), math.sin(self.direction_rad)
        return (cosine * dx + sine * dy, cosine * dy - sine * dx)


class Circle(NamedTuple):
    """A round obstacle."""

    x_m: float
    y_m: float
    radius_m: float

    def distance(self, x_m: float, y_m: float) -> float:
        """Return a point's distance from the surface; negative inside."""
        return math.hypot(x_m - self.x_m, y_m - self.y_m) - self.radius_m

    def echo(self, beam: Beam) -> float:
        """The surface is nearest on the ray that passes nearest to the centre."""
        along, aside = beam.seen_from(self.x_m, self.y_m)
        distance = math.hypot(along, aside)
        if distance <= self.radius_m:
            return 0.0
        off = max(0.0, math.atan2(abs(aside), along) - beam.half_angle_rad)
        passes_at = distance * math.sin(off)
        if off >= 0.5 * math.pi or passes_at > self.radius_m:
            return math.inf
        return distance * math.cos(off) - math.sqrt(self.radius_m**2 - passes_at**2)


class Wall(NamedTuple):
    """A straight wall without thickness, from one end to the other."""

    x1_m: float
    y1_m: float
    x2_m: float
    y2_m: float

    def distance(self, x_m: float, y_m: float) -> float:
        """Return a point's distance from the wall."""
        start = (self.x1_m - x_m, self.y1_m - y_m)
        return _nearest(start, (self.x2_m - x_m, self.y2_m - y_m), 0.0, 1.0)

    def echo(self, beam: Beam) -> float:
        """The wall is cut off at the beam's two edges; what is left has a nearest point."""
        start = beam.seen_from(self.x1_m, self.y1_m)
        end = beam.seen_from(self.x2_m, self.y2_m)
        first, last = 0.0, 1.0
        for side in (1.0, -1.0):
            before, after = (_inside(point, beam.half_angle_rad, side) for point in (start, end))
            if before < 0.0 and after < 0.0:
                return math.inf
            if before < 0.0:
                first = max(first, before / (before - after))
            elif after < 0.0:
                last = min(last, before / (before - after))
        return _nearest(start, end, first, last) if first <= last else math.inf


Shape: TypeAlias = Circle | Wall
"""Something that echoes and that stops a vehicle."""


def _inside(point: Point, half_angle_rad: float, side: float) -> float:
    """Return the depth of a point in the beam's axes within its left (1) or right (-1) edge."""
    along, aside = point
    return math.sin(half_angle_rad) * along - side * math.cos(half_angle_rad) * aside


def _nearest(start: Point, end: Point, first: float, last: float) -> float:
    """Return a line's least distance from the origin between two shares of its way."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    foot = -(start[0] * dx + start[1] * dy) / (dx * dx + dy * dy)
    share = min(max(foot, first), last)
    return math.hypot(start[0] + share * dx, start[1] + share * dy)
