"""Paths by formula: stay, a straight line from rest to rest, a circle, and the way back to a path.

The line's speed is a trapezoid (constant acceleration, constant speed, constant deceleration) or a
minimum-jerk polynomial, 10 u^3 - 15 u^4 + 6 u^5, whose acceleration begins and ends at zero.
The way back to a path from wherever the body is has no jump: the setpoint is the path's plus an
offset that begins as the body's own distance and speed and ends as nothing, by a polynomial of
degree five. The path waits meanwhile and then gathers speed: its own time runs at a pace of 0 to 1.

Source of the minimum-jerk polynomial: Flash, Hogan: The Coordination of Arm Movements, Journal of
Neuroscience 1985.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from msgspec import Struct

from firmware_runtime.models.motion import PoseSetpoint, Profile, Setpoint, at_rest
from firmware_runtime.system.elementary import cos_sin, hypot

PEAK_SPEED: Final = 15.0 / 8.0
"""Of a minimum-jerk motion: its greatest speed, in units of distance / duration."""
PEAK_ACCELERATION: Final = 10.0 / math.sqrt(3.0)
"""Likewise its greatest acceleration, in units of distance / duration^2."""


class Pose(NamedTuple):
    """A place and a direction: m and rad."""

    x_m: float
    y_m: float
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class Hold:
    """Stays at a pose."""

    pose: Pose

    @property
    def duration_s(self) -> float:
        """None: it is there at once."""
        return 0.0

    def at(self, t_s: float) -> PoseSetpoint:  # noqa: ARG002 -- as every path
        """The pose."""
        return PoseSetpoint(*map(at_rest, self.pose))


class Line:
    """Goes straight from one pose to another, at rest at both, no faster than stated.

    Yaw turns in proportion to the way. Raises ValueError for poses at the same place.
    """

    def __init__(
        self, begin: Pose, end: Pose, speed_m_s: float, acceleration_m_s2: float, profile: Profile
    ) -> None:
        distance = hypot(end.x_m - begin.x_m, end.y_m - begin.y_m)
        if not distance > 0.0:
            raise ValueError(f"a line from {begin[:2]} to {end[:2]} m has no length")
        self._begin = begin
        self._way = tuple(b - a for a, b in zip(begin, end, strict=True))
        if profile == "trapezoid":
            trapezoid = _Trapezoid(distance, speed_m_s, acceleration_m_s2)
            self._share: Callable[[float], Setpoint] = trapezoid.share
            self._duration_s = trapezoid.duration_s
        else:
            self._duration_s = smooth_duration_s(distance, speed_m_s, acceleration_m_s2)
            self._share = lambda t_s: smooth(t_s, self._duration_s)

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return self._duration_s

    def at(self, t_s: float) -> PoseSetpoint:
        """The setpoint, on the straight line between the poses."""
        share, rate, acceleration = self._share(t_s)
        return PoseSetpoint(
            *(
                Setpoint(begin + way * share, way * rate, way * acceleration)
                for begin, way in zip(self._begin, self._way, strict=True)
            )
        )


@dataclass(frozen=True, slots=True)
class Circle:
    """Goes round at constant speed, without end; the first setpoint is already moving."""

    centre: Pose
    """Its yaw is held, or is that of the first setpoint where yaw turns with the path."""
    radius_m: float
    lap_s: float
    """Time of one round."""
    start_rad: float = 0.0
    """Direction from the centre in which it begins; zero is x."""
    clockwise: bool = False
    turns: bool = False
    """Whether yaw turns with the path, one turn a lap."""

    @property
    def duration_s(self) -> float:
        """Infinite."""
        return math.inf

    def at(self, t_s: float) -> PoseSetpoint:
        """The setpoint, `radius_m` from the centre."""
        rate = (-math.tau if self.clockwise else math.tau) / self.lap_s
        turned = rate * t_s
        cosine, sine = cos_sin(self.start_rad + turned)
        across, along = self.radius_m * cosine, self.radius_m * sine
        x, y, yaw = self.centre
        return PoseSetpoint(
            Setpoint(x + across, -rate * along, -rate * rate * across),
            Setpoint(y + along, rate * across, -rate * rate * along),
            Setpoint(yaw + turned, rate, 0.0) if self.turns else at_rest(yaw),
        )


class _Trapezoid:
    """The share of a way that a trapezoid of speed has covered; a triangle on a short one."""

    def __init__(self, distance: float, speed: float, acceleration: float) -> None:
        peak = min(speed, math.sqrt(distance * acceleration))
        self._acceleration = acceleration / distance
        self._peak = peak / distance
        self._ramp_s = peak / acceleration
        self.duration_s = distance / peak + self._ramp_s

    def share(self, t_s: float) -> Setpoint:
        """0 to 1, with its rates; the second half mirrors the first."""
        if t_s >= self.duration_s:
            return at_rest(1.0)
        if t_s > self.duration_s - self._ramp_s:
            share, rate, acceleration = self._speeding_up(self.duration_s - t_s)
            return Setpoint(1.0 - share, rate, -acceleration)
        return self._speeding_up(t_s)

    def _speeding_up(self, t_s: float) -> Setpoint:
        if t_s >= self._ramp_s:
            return Setpoint(self._peak * (t_s - self._ramp_s / 2), self._peak, 0.0)
        rate = self._acceleration * t_s
        return Setpoint(rate * t_s / 2, rate, self._acceleration)


def smooth(t_s: float, duration_s: float) -> Setpoint:
    """The share, 0 to 1, of a minimum-jerk motion, with its rates."""
    if t_s >= duration_s:
        return at_rest(1.0)
    u = t_s / duration_s
    hill = u * (1.0 - u)
    return Setpoint(
        u * u * u * (10.0 - u * (15.0 - 6.0 * u)),
        30.0 * (hill * hill) / duration_s,
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / (duration_s * duration_s),
    )


def smooth_duration_s(distance: float, speed: float, acceleration: float) -> float:
    """Return how long a minimum-jerk motion takes that exceeds neither speed nor acceleration."""
    by_acceleration = math.sqrt(PEAK_ACCELERATION * distance / acceleration)
    return max(PEAK_SPEED * distance / speed, by_acceleration)


PEAK_BRAKING = 4.0
"""Of the polynomial that ends a speed: its greatest deceleration, in units of speed / duration."""


class RejoinLimits(NamedTuple):
    """Limits within which a body goes back to its path."""

    speed_m_s: float
    acceleration_m_s2: float
    yaw_speed_rad_s: float
    least_s: float
    """However near it is."""
    ramp_s: float
    """From standing still to the path's own speed."""


class Rejoin(Struct, frozen=True):
    """From a motion to a path's setpoint, which stands still until it is reached."""

    offsets: tuple[tuple[float, float], ...]
    """x, y and yaw less the path's, with their rates."""
    along_s: float
    """Where on the path."""
    ramp_s: float
    duration_s: float

    def along(self, t_s: float) -> Setpoint:
        """The path's own time (s), its pace and the pace's rate, `t_s` after the beginning."""
        moved_s, ramp_s = t_s - self.duration_s, self.ramp_s
        if moved_s <= 0.0:
            return Setpoint(self.along_s, 0.0, 0.0)
        if moved_s >= ramp_s:
            return Setpoint(self.along_s + moved_s - ramp_s / 2, 1.0, 0.0)
        u = moved_s / ramp_s
        pace = smooth(moved_s, ramp_s)
        gone_s = ramp_s * (u * u * u * u) * (2.5 - u * (3.0 - u))
        return Setpoint(self.along_s + gone_s, pace.position, pace.rate)

    def added_to(self, setpoint: PoseSetpoint, t_s: float) -> PoseSetpoint:
        """The setpoint with what is left of the offset."""
        if t_s >= self.duration_s:
            return setpoint
        return PoseSetpoint(
            *(
                Setpoint(*(of + by for of, by in zip(each, self._left(offset, t_s), strict=True)))
                for each, offset in zip(setpoint, self.offsets, strict=True)
            )
        )

    def _left(self, offset: tuple[float, float], t_s: float) -> Setpoint:
        span = self.duration_s
        u, distance, speed = t_s / span, offset[0], offset[1] * span
        third = -10.0 * distance - 6.0 * speed
        fourth = 15.0 * distance + 8.0 * speed
        fifth = -6.0 * distance - 3.0 * speed
        return Setpoint(
            distance + u * (speed + u * u * (third + u * (fourth + u * fifth))),
            (speed + u * u * (3.0 * third + u * (4.0 * fourth + 5.0 * u * fifth))) / span,
            u * (6.0 * third + u * (12.0 * fourth + 20.0 * u * fifth)) / (span * span),
        )


def rejoin(offsets: Sequence[tuple[float, float]], limits: RejoinLimits, along_s: float) -> Rejoin:
    """The way back from so far off, within these limits, to where on the path it is."""
    return Rejoin(tuple(offsets), along_s, limits.ramp_s, _duration_s(offsets, limits))


def _duration_s(offsets: Sequence[tuple[float, float]], limits: RejoinLimits) -> float:
    (x, vx), (y, vy), (yaw, _) = offsets
    way = smooth_duration_s(hypot(x, y), limits.speed_m_s, limits.acceleration_m_s2)
    braking = PEAK_BRAKING * hypot(vx, vy) / limits.acceleration_m_s2
    turning = PEAK_SPEED * abs(yaw) / limits.yaw_speed_rad_s
    return max(limits.least_s, way, braking, turning)
