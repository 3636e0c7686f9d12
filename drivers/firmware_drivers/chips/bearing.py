"""Bearing that every compass driver reads: a direction, and how far to trust it."""

from typing import NamedTuple


class Bearing(NamedTuple):
    """One reading."""

    bearing_deg: float
    """Clockwise from magnetic north, 0 up to but not including 360."""
    calibration: int | None
    """0 (none) to 3 (full), by the chip's own judgement; None if it makes none."""


def in_circle(angle_deg: float) -> float:
    """Bring an angle to 0 up to but not including 360 degrees."""
    return angle_deg % 360.0 % 360.0  # twice: a tiny negative angle comes out of the first as 360
