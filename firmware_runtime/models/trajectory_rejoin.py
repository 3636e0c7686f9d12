"""The way back to a path from wherever the body is, without a jump.

The setpoint is the path's plus an offset that begins as the body's own distance and speed and ends
as nothing, by a polynomial of degree five. The path waits meanwhile and then gathers speed: its own
time runs at a pace from 0 to 1.
"""

from collections.abc import Sequence
from typing import NamedTuple

from msgspec import Struct

from firmware_runtime.models.trajectory import PoseSetpoint, Setpoint
from firmware_runtime.models.trajectory_paths import PEAK_SPEED, smooth, smooth_duration_s
from firmware_runtime.system.elementary import hypot

PEAK_BRAKING = 4.0
"""Of the polynomial that ends a speed: its greatest deceleration, in units of speed / duration."""


class RejoinLimits(NamedTuple):
    """How fast a body may go back to its path."""

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
