"""Motions, setpoints and paths: what a controller measures, and what a moving body is to do.

A setpoint is a position with its rate and its acceleration: a controller that knows all three need
not wait for an error before it pushes. A path gives the setpoint of a pose for every instant of its
own time; `trajectory_source` runs along it in the time of a model.
"""

from typing import Literal, NamedTuple, Protocol, TypeAlias


class Motion(NamedTuple):
    """A measured coordinate and its rate: m and m/s, or rad and rad/s."""

    position: float
    rate: float


Profile: TypeAlias = Literal["trapezoid", "minimum-jerk"]
"""How the speed grows and falls on a way from rest to rest."""


class Setpoint(NamedTuple):
    """One coordinate: m, m/s and m/s2, or rad, rad/s and rad/s2."""

    position: float
    rate: float
    acceleration: float


class PoseSetpoint(NamedTuple):
    """A pose in the plane, in the axes of the room: x and y level, yaw from x to y."""

    x: Setpoint
    y: Setpoint
    yaw: Setpoint


class Path(Protocol):
    """Where a pose goes, as a function of the path's own time."""

    @property
    def duration_s(self) -> float:
        """How long it takes; infinite for one without end."""

    def at(self, t_s: float) -> PoseSetpoint:
        """The setpoint at an instant, 0 or more; past the end, that of the end, at rest."""


def at_rest(position: float) -> Setpoint:
    """A coordinate that does not move."""
    return Setpoint(position, 0.0, 0.0)
