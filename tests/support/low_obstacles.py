"""Arenas drawn by a seed, with something in the detective's way that its radar looks over.

Each arena has its target at 2 to 4 m in any direction, a low wall of 0.6 to 1.6 m across the way,
slanted by up to 30 degrees, and two low circles beside. Missions run in virtual time on
register-level doubles, with `mission.avoid_obstacles` and 600 s at most.
"""

import math
import random

from tests.support.virtual_detective import virtual_detective

LONGEST_S = 600
APART_M = 0.45
"""Between a circle and start, target, wall and each other: what the vehicle fits through."""


def mission(seed: int, *assignments: str) -> dict[str, object]:
    """The mission in one arena, and whether anything was touched."""
    keys = ("mission.avoid_obstacles=true", f"mission.longest_s={LONGEST_S}", f"world.seed={seed}")
    robot = virtual_detective(*keys, *arena(seed), *assignments)
    ended = robot.run_mission(LONGEST_S + 10)
    return {"seed": seed, **ended, "touched": robot.rig.arena.collided}


def arena(seed: int) -> list[str]:
    """The overrides that make the arena of a seed."""
    draw = random.Random(seed)  # noqa: S311 -- no secret
    bearing, distance_m = draw.uniform(0, math.tau), draw.uniform(2, 4)
    ahead = (math.sin(bearing), math.cos(bearing))
    target = (distance_m * ahead[0], distance_m * ahead[1])
    way_m = draw.uniform(1.0, distance_m - 0.9)
    slant = bearing + math.pi / 2 + draw.uniform(-math.pi / 6, math.pi / 6)
    left_m, right_m = draw.uniform(0.3, 0.8), draw.uniform(0.3, 0.8)
    middle = (way_m * ahead[0], way_m * ahead[1])
    wall = [
        round(middle[axis] + along * (math.sin(slant), math.cos(slant))[axis], 3)
        for along in (-left_m, right_m)
        for axis in (0, 1)
    ]
    circles: list[list[float]] = []
    while len(circles) < 2:
        circle = [draw.uniform(-3, 3), draw.uniform(-3, 3), draw.uniform(0.05, 0.2)]
        if _is_apart(circle, [(0.0, 0.0), target, *_points(wall)], circles):
            circles.append([round(each, 3) for each in circle])
    return [
        f"world.target=[{target[0]:.3f}, {target[1]:.3f}]",
        f"world.low_walls=[{wall}]",
        f"world.low_obstacles={circles}",
    ]


def _points(wall: list[float]) -> list[tuple[float, float]]:
    x1, y1, x2, y2 = wall
    shares = [number / 10 for number in range(11)]
    return [(x1 + share * (x2 - x1), y1 + share * (y2 - y1)) for share in shares]


def _is_apart(
    circle: list[float], points: list[tuple[float, float]], circles: list[list[float]]
) -> bool:
    x, y, radius = circle
    others = [(*point, 0.1) for point in points] + [(cx, cy, r) for cx, cy, r in circles]
    return all(math.hypot(x - cx, y - cy) - radius - r > APART_M for cx, cy, r in others)
