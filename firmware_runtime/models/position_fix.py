"""Positions by a tracking system in the room, and how far they are to be believed."""

import math
from enum import Enum, auto
from typing import NamedTuple

__all__ = [
    "FixReport",
    "PlanarInertial",
    "PoseCovariance",
    "PoseFix",
    "PositionFix",
    "PositionState",
]


class PositionFix(NamedTuple):
    """A measured position, in the axes of the room."""

    x_m: float
    y_m: float
    age_s: float
    """How long ago it was measured when it is put in: the instant counts, not the arrival."""


class PoseFix(NamedTuple):
    """A measured position and direction."""

    x_m: float
    y_m: float
    yaw_rad: float
    """From x to y; by how many whole turns is of no account."""
    age_s: float


class PlanarInertial(NamedTuple):
    """Inertial sample and attitude of a level body, at one instant."""

    forward_m_s2: float
    """Specific force along the body's x."""
    left_m_s2: float
    yaw_rad: float
    """Continuous: it does not jump by a turn."""
    yaw_rate_rad_s: float


class PositionState(Enum):
    """Quality of the position."""

    NO_POSITION = auto()
    TRACKING = auto()
    COASTING = auto()
    """No position for a while: on the inertial unit alone."""
    LOST = auto()
    """For too long: only speed and yaw are any good."""
    SAFE = auto()
    """Given up."""


class PoseCovariance(NamedTuple):
    """Covariance of an estimate: in x as in y, which do not depend on each other."""

    position_m2: float
    position_velocity_m2_s: float
    velocity_m2_s2: float
    bias_m2_s4: float
    yaw_rad2: float
    """Of the angle between the room and the attitude; 0 while no yaw was measured."""


class FixReport(NamedTuple):
    """Outcome of a fix."""

    is_taken: bool
    reason: str
    """Why it was not taken; empty if it was."""
    age_s: float
    """How old it was when it was used."""
    innovation_x_m: float
    """How far it was from where it was expected; 0 where nothing was."""
    innovation_y_m: float
    normalized: float
    """The squares of both over their variances, summed: chi square of two degrees of freedom."""
    has_begun_again: bool = False
    """Whether it was not what was expected, and the filter began again with it."""


def is_sound(fix: PositionFix | PoseFix) -> bool:
    """Return whether all of its numbers are finite and its age is none of the future."""
    return all(map(math.isfinite, fix)) and fix.age_s >= 0.0
