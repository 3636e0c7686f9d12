"""The Kalman filter of one axis: position, velocity, and the bias of a measured acceleration.

    position' = velocity,  velocity' = acceleration - bias + white noise,  bias' = white noise

A span of constant acceleration is taken in exactly; a measured position corrects all three. State
and covariance are one tuple of nine floats, so that many of them can be kept and none is changed.

Source: Bar-Shalom, Li, Kirubarajan: Estimation with Applications to Tracking and Navigation, 2001.
"""

from typing import NamedTuple, TypeAlias

from firmware_runtime.models.position_fix import AxisCovariance

Axis: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]
"""Position, velocity, bias; then the covariance's upper triangle, row by row."""


class FilterNoise(NamedTuple):
    """How uncertain everything is, as standard deviations."""

    position_m: float
    """Of a measured position."""
    yaw_rad: float
    """Of a measured yaw."""
    acceleration: float
    """Of the measured acceleration, a density, m/s2 over root Hz."""
    bias_walk: float
    """How the bias wanders, m/s2 in a root second."""
    yaw_walk: float
    """How the attitude's zero wanders, rad in a root second."""
    first_velocity_m_s: float
    """Of the velocity, 0, that a filter begins with."""
    first_bias_m_s2: float
    """Of the bias, 0, that it begins with."""


def first(position: float, noise: FilterNoise) -> Axis:
    """The axis at the first measured position."""
    velocity, bias = noise.first_velocity_m_s, noise.first_bias_m_s2
    variance = noise.position_m * noise.position_m
    return (position, 0.0, 0.0, variance, 0.0, 0.0, velocity * velocity, 0.0, bias * bias)


def restarted(axis: Axis, position: float, noise: FilterNoise) -> Axis:
    """The axis at a position that nobody expected: what was known of the bias is kept."""
    _, _, bias, *_, bias_variance = axis
    start = first(position, noise)
    return (*start[:2], bias, *start[3:8], bias_variance)


def predicted(axis: Axis, acceleration: float, span_s: float, noise: FilterNoise) -> Axis:
    """The axis after a span of constant measured acceleration."""
    p, v, b, pp, pv, pb, vv, vb, bb = axis
    half = 0.5 * span_s * span_s
    net = acceleration - b
    along, across = pb + span_s * vb - half * bb, vb - span_s * bb
    pv_half = pv + span_s * vv - half * vb
    white = noise.acceleration * noise.acceleration * span_s
    return (
        p + span_s * v + half * net,
        v + span_s * net,
        b,
        pp + span_s * pv - half * pb + span_s * pv_half - half * along
        + white * span_s * span_s / 3.0,
        pv_half - span_s * along + white * span_s / 2.0,
        along,
        vv - span_s * vb - span_s * across + white,
        across,
        bb + noise.bias_walk * noise.bias_walk * span_s,
    )  # fmt: skip


def innovation(axis: Axis, position: float, noise: FilterNoise) -> tuple[float, float]:
    """How far a measured position is from the expected one, and the variance of that."""
    return position - axis[0], axis[3] + noise.position_m * noise.position_m


def corrected(axis: Axis, off: float, variance: float) -> Axis:
    """The axis after a measured position that was `off` the expected one."""
    p, v, b, pp, pv, pb, vv, vb, bb = axis
    by_p, by_v, by_b = pp / variance, pv / variance, pb / variance
    return (
        p + by_p * off,
        v + by_v * off,
        b + by_b * off,
        pp - by_p * pp,
        pv - by_p * pv,
        pb - by_p * pb,
        vv - by_v * pv,
        vb - by_v * pb,
        bb - by_b * pb,
    )


def covariance(axis: Axis) -> AxisCovariance:
    """The covariance alone."""
    return AxisCovariance(*axis[3:])
