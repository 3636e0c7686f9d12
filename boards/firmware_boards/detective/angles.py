"""Angles in degrees, of any size: 370 is 10, -90 is 270.

Differences are taken to a thousand-millionth of a degree, so that decimals equal modulo 360, such
as 560.1 and 200.1, are found equal although their binary fractions differ.
"""

from typing import Final

NEAR_DEG: Final = 45.0
"""What lies between two angles is nearer to either: there is no other side farther away."""


def growth(start: float, end: float) -> float:
    """Return the angle from `start` up to `end`: 0 up to, but not including, 360."""
    return round((end - start) % 360, 9) % 360


def are_close(angle: float, other: float, tolerance: float) -> bool:
    """Return whether the shorter way from one to the other is `tolerance` at most."""
    grown = growth(angle, other)
    return min(grown, 360 - grown) <= tolerance


def shorter_way_grows(heading: float, target: float) -> bool:
    """Return whether angles grow when the vehicle turns the shorter way from `heading` to `target`.

    Half a turn grows if the heading is the greater number; no turn at all does not.
    """
    grown = growth(heading, target)
    return 0 < grown < 180 or (grown == 180 and heading > target)


def is_between(start: float, angle: float, end: float) -> bool:
    """Return whether an angle lies between two that are near it, one on either side."""
    grown = growth(start, angle), growth(angle, end)
    return max(grown) < NEAR_DEG or min(grown) > 360 - NEAR_DEG
