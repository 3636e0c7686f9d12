"""Geometry of a state graph: circles on a ring, curves between them, boxes beside the curves."""

from collections.abc import Sequence
from itertools import pairwise
from math import cos, hypot, pi, sin
from typing import Final

from firmware_runtime.view.diagram.canvas import Point, Rectangle

GAP: Final = 74
"""Clear space between neighbours on the ring, room for an arrow."""

SAMPLES: Final = 24
"""Number of pieces that a curve is looked at in."""


def overlap(one: Rectangle, other: Rectangle) -> float:
    """The area that both take up."""
    width = min(one.right, other.right) - max(one.left, other.left)
    height = min(one.bottom, other.bottom) - max(one.top, other.top)
    return max(width, 0) * max(height, 0)


def holds(box: Rectangle, point: Point) -> bool:
    """Return whether a point lies within."""
    return box.left <= point.x <= box.right and box.top <= point.y <= box.bottom


def ring(states: int, radius: float) -> list[Point]:
    """Centres of circles of that radius, clockwise from the upper left or, for two, the left."""
    if states == 1:
        return [Point(0, 0)]
    size = (2 * radius + GAP) / (2 * sin(pi / states))
    first = pi if states == 2 else -pi / 2 - pi / states
    angles = [first + 2 * pi * number / states for number in range(states)]
    return [Point(size * cos(angle), size * sin(angle)) for angle in angles]


def between(start: Point, end: Point, radius: float, bulge: float) -> list[Point]:
    """The quadratic curve from circle to circle; `bulge` is how far left, by their distance.

    Clockwise round the ring, left is outside.
    """
    left = Point(bulge * (end.y - start.y), bulge * (start.x - end.x))
    middle = Point((start.x + end.x) / 2 + left.x, (start.y + end.y) / 2 + left.y)
    return [_towards(start, middle, radius), middle, _towards(end, middle, radius + 1)]


def loop(centre: Point, radius: float, reach: float) -> list[Point]:
    """The cubic curve that leaves a circle away from the ring's middle and comes back to it."""
    out = outward(centre)
    sides = [_turn(out, angle) for angle in (-0.45, 0.45)]
    near = [Point(centre.x + radius * each.x, centre.y + radius * each.y) for each in sides]
    far = [Point(centre.x + reach * each.x, centre.y + reach * each.y) for each in sides]
    return [near[0], far[0], far[1], near[1]]


def outward(centre: Point) -> Point:
    """The direction from the ring's middle through a point, of length 1; to the left if it is."""
    distance = hypot(centre.x, centre.y)
    return Point(centre.x / distance, centre.y / distance) if distance else Point(-1.0, 0.0)


def point_on(curve: Sequence[Point], part: float) -> Point:
    """The point of a Bezier curve at `part` (0 to 1) of its way."""
    points = list(curve)
    while len(points) > 1:
        points = [
            Point(one.x + part * (two.x - one.x), one.y + part * (two.y - one.y))
            for one, two in pairwise(points)
        ]
    return points[0]


def samples(curve: Sequence[Point]) -> list[Point]:
    """Points all along a curve."""
    return [point_on(curve, number / SAMPLES) for number in range(SAMPLES + 1)]


def beside(curve: Sequence[Point], part: float, side: int, size: Point) -> Rectangle:
    """A box of that size touching the curve at `part`, on its left (side 1) or its right (-1)."""
    at, ahead = point_on(curve, part), point_on(curve, part + 0.01)
    length = hypot(ahead.x - at.x, ahead.y - at.y) or 1.0
    normal = Point(side * (ahead.y - at.y) / length, side * (at.x - ahead.x) / length)
    reach = abs(normal.x) * size.x / 2 + abs(normal.y) * size.y / 2 + 5
    x, y = at.x + reach * normal.x, at.y + reach * normal.y
    return Rectangle(x - size.x / 2, y - size.y / 2, size.x, size.y)


def _towards(start: Point, end: Point, distance: float) -> Point:
    length = hypot(end.x - start.x, end.y - start.y)
    part = distance / length
    return Point(start.x + part * (end.x - start.x), start.y + part * (end.y - start.y))


def _turn(direction: Point, angle: float) -> Point:
    return Point(
        direction.x * cos(angle) - direction.y * sin(angle),
        direction.x * sin(angle) + direction.y * cos(angle),
    )
