"""TachoBot from above, as its ports say: where it is, its yaw, and how its propellers push."""

import math
from collections.abc import Iterator
from typing import Final

from firmware_runtime.view.parts import Arrow, Body, Bound, Plane, Shape
from sim_doubles.worlds.tachobot_body import Mounting

__all__ = ["tachobot_plane"]

_ROOM_M: Final = 1.5
"""To each side of the origin, where it is free to move."""
_PAIRS: Final = ((0, -1, 0.0), (1, 0, -math.pi / 2), (0, 1, math.pi), (-1, 0, math.pi / 2))
"""Each pair's place in lever arms, and the direction of its force, as equation (2) has them."""


def tachobot_plane(lever_arm_m: float, mounting: Mounting) -> Plane:
    """The robot with an arrow for each propeller: half its lever arm long at full duty."""
    ends = None if mounting == "platform" else (-_ROOM_M, _ROOM_M)
    return Plane(
        title="TachoBot from above, as it truly is",
        bodies=[
            Body(
                "TachoBot",
                list(_shapes(lever_arm_m)),
                x=Bound("world.x", "position"),
                y=Bound("world.y", "position"),
                heading_rad=Bound("world.yaw_rad"),
                arrows=list(_arrows(lever_arm_m)),
                has_trail=mounting != "platform",
            )
        ],
        across_ends=ends,
        up_ends=ends,
    )


def _shapes(arm_m: float) -> Iterator[Shape]:
    """Yield two bars with a propeller pair at each end, the hub, and a mark at the front."""
    yield Shape("line", [(-arm_m, 0.0), (arm_m, 0.0)])
    yield Shape("line", [(0.0, -arm_m), (0.0, arm_m)])
    yield Shape("circle", [(0.0, 0.0)], 0.35 * arm_m, look="body", name="TachoBot")
    for x, y, _ in _PAIRS:
        yield Shape("circle", [(x * arm_m, y * arm_m)], 0.15 * arm_m, name="a pair of propellers")
    tip, sides = (0.33 * arm_m, 0.0), [(0.15 * arm_m, side * 0.1 * arm_m) for side in (-1, 1)]
    yield Shape("polygon", [tip, *sides], look="nose")


def _arrows(arm_m: float) -> Iterator[Arrow]:
    """Yield the force of each propeller by its duty; the second of a pair pushes backwards."""
    for pair, (x, y, direction_rad) in enumerate(_PAIRS):
        for second in (0, 1):
            number = 2 * pair + second
            yield Arrow(
                (x * arm_m, y * arm_m),
                direction_rad + second * math.pi,
                Bound("thrust_pairs.duties", str(number), scale=0.5 * arm_m),
                f"propeller {number + 1}",
            )
