"""The Kalman filter of a body in the plane: position, velocity, and the bias of its accelerometer.

    position' = velocity,  velocity' = turned (acceleration - bias) + noise,  bias' = noise

Acceleration and bias are in the axes of the body, the rest in those of the room. A place in the
plane is a complex number, x + i y: turning is a product, and since x and y are measured alike, the
covariance of both axes together is a Hermitian matrix of three by three. So a bias that turns with
its body is estimated exactly, in half the arithmetic. A span of constant acceleration is taken in
exactly. State and covariance are one tuple, so that many can be kept and none is changed.

Source: Bar-Shalom, Li, Kirubarajan: Estimation with Applications to Tracking and Navigation, 2001.
"""

from typing import NamedTuple


class FilterNoise(NamedTuple):
    """How uncertain everything is, as standard deviations in each axis."""

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


class Planar(NamedTuple):
    """The estimate, x + i y each, and the upper triangle of its covariance, of one axis."""

    position: complex
    velocity: complex
    bias: complex
    """Forward + i left."""
    pp: float
    pv: complex
    pb: complex
    vv: float
    vb: complex
    bb: float


def first(position: complex, noise: FilterNoise) -> Planar:
    """The estimate at the first measured position."""
    velocity, bias = noise.first_velocity_m_s, noise.first_bias_m_s2
    variance = noise.position_m * noise.position_m
    return Planar(position, 0j, 0j, variance, 0j, 0j, velocity * velocity, 0j, bias * bias)


def restarted(planar: Planar, position: complex, noise: FilterNoise) -> Planar:
    """The estimate at an unexpected position: what is known of the bias is kept."""
    return first(position, noise)._replace(bias=planar.bias, bb=planar.bb)


def predicted(
    planar: Planar, acceleration: complex, turn: complex, span_s: float, noise: FilterNoise
) -> Planar:
    """The estimate after a span of constant acceleration; `turn` is the body's direction in it."""
    p, v, b, pp, pv, pb, vv, vb, bb = planar
    back, half = turn.conjugate(), 0.5 * span_s * span_s
    net = turn * (acceleration - b)
    pb, vb = pb * back, vb * back
    bv = vb.conjugate()
    along, across = pb + span_s * vb - half * bb, vb - span_s * bb
    pv_half = pv + span_s * vv - half * bv
    pp_half = pp + span_s * pv.conjugate() - half * pb.conjugate()
    white = noise.acceleration * noise.acceleration * span_s
    return Planar(
        p + span_s * v + half * net,
        v + span_s * net,
        b,
        (pp_half + span_s * pv_half - half * along).real + white * span_s * span_s / 3.0,
        pv_half - span_s * along + white * span_s / 2.0,
        along * turn,
        (vv - span_s * bv - span_s * across).real + white,
        across * turn,
        bb + noise.bias_walk * noise.bias_walk * span_s,
    )


def innovation(planar: Planar, position: complex, noise: FilterNoise) -> tuple[complex, float]:
    """How far a measured position is from the expected one, and the variance in each axis."""
    return position - planar.position, planar.pp + noise.position_m * noise.position_m


def corrected(planar: Planar, off: complex, variance: float) -> Planar:
    """The estimate after a measured position that was `off` the expected one."""
    p, v, b, pp, pv, pb, vv, vb, bb = planar
    by_p, by_v, by_b = pp / variance, pv.conjugate() / variance, pb.conjugate() / variance
    return Planar(
        p + by_p * off,
        v + by_v * off,
        b + by_b * off,
        pp - by_p * pp,
        pv - by_p * pv,
        pb - by_p * pb,
        vv - (by_v * pv).real,
        vb - by_v * pb,
        bb - (by_b * pb).real,
    )
