"""The Kalman filter of a body in the plane: position, velocity, and the bias of its accelerometer.

    position' = velocity,  velocity' = turned (acceleration - bias) + noise,  bias' = noise

Acceleration and bias are in the axes of the body, the rest in those of the room. A place in the
plane is a complex number, x + i y: turning is a product, and since x and y are measured alike, the
covariance of both axes together is a Hermitian matrix of three by three. So a bias that turns with
its body is estimated exactly, in half the arithmetic. A span of constant acceleration is taken in
exactly. State and covariance are one tuple, so that many can be kept and none is changed.

A position counts at the instant it was taken. The past is a row of spans, each with its
acceleration in body axes, its attitude, the filter's state at its beginning and the fixes that
belong into it. A fix is put into its span, and everything from there on is computed once more: the
result is what would have come out had every fix come at once, to the bit. The row has a bounded
length; a fix from before it is refused.

Source: Bar-Shalom, Li, Kirubarajan: Estimation with Applications to Tracking and Navigation, 2001.
"""

import math
from collections import deque
from typing import NamedTuple

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.position_fix import FixReport, PlanarInertial, PoseFix, PositionFix
from firmware_runtime.system.elementary import cos_sin


class FilterNoise(NamedTuple):
    """Noise of every source, as standard deviations in each axis."""

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
    """Return a measured position less the expected one, and the variance in each axis."""
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


TOO_OLD = "older than what is kept"
OFF_GATE = "too far from where it was expected"


class Estimate(NamedTuple):
    """The filter's state at an instant."""

    planar: Planar
    offset_rad: float
    """The room's yaw less the attitude's."""
    offset_variance: float
    """0 while no yaw was measured: the attitude's zero is the room's then."""


class Taken(NamedTuple):
    """A fix at the instant it was measured."""

    at: int
    fix: PositionFix | PoseFix
    may_restart: bool
    """Whether it begins the filter again where it is not what was expected."""


class Span(Struct, eq=False):
    """From one inertial sample to the next, with the mean of both, which holds in its middle."""

    begin: int
    end: int
    mean: PlanarInertial
    state: Estimate | None = None
    """At its beginning; None before any fix."""
    fixes: list[Taken] = []


class PositionHistory:
    """The spans of the last `length` samples; `state` is the estimate at the end of the last."""

    def __init__(self, length: int, noise: FilterNoise, gate: float) -> None:
        self.state: Estimate | None = None
        self.noise = noise
        self.gate = gate
        """Greatest normalized square of an innovation, and of a yaw's, that is believed."""
        self._spans: deque[Span] = deque(maxlen=length)

    def add(self, span: Span) -> None:
        """Take the newest span in and go to its end."""
        span.state = self.state
        self._spans.append(span)
        self.state = self._through(span)

    def insert(self, fixes: list[Taken]) -> list[FixReport]:
        """Put fixes where they belong and work out the present again; say what became of each."""
        if not fixes:
            return []
        now = self._spans[-1].end if self._spans else 0
        places: list[int] = []
        for fix in fixes:
            place = self._place_of(fix.at)
            if place is not None:
                _put(fix, self._spans[place].fixes)
                places.append(place)
        found: dict[int, FixReport] = {}
        if places:
            self._replay(min(places), found, now)
        refused = FixReport(False, TOO_OLD, 0.0, 0.0, 0.0, 0.0)
        return [
            found.get(id(fix), refused._replace(age_s=(now - fix.at) / SECOND)) for fix in fixes
        ]

    # ---------------------------------------------------------------------------------------------

    def _place_of(self, at: int) -> int | None:
        """The span in which an instant lies, from the newest back; None if it is not kept."""
        for place in range(len(self._spans) - 1, -1, -1):
            if at > self._spans[place].begin:
                return place
        return None

    def _replay(self, place: int, found: dict[int, FixReport], now: int) -> None:
        state = self._spans[place].state
        for n in range(place, len(self._spans)):
            span = self._spans[n]
            span.state = state
            state = self._through(span, found, now)
        self.state = state

    def _through(
        self, span: Span, found: dict[int, FixReport] | None = None, now: int = 0
    ) -> Estimate | None:
        """The state at the end of a span, by way of its fixes."""
        state, at = span.state, span.begin
        for fix in span.fixes:
            state = self._moved(state, span, at, fix.at)
            at = fix.at
            state, report = self._corrected(state, span, fix)
            if found is not None:
                found[id(fix)] = report._replace(age_s=(now - at) / SECOND)
        return self._moved(state, span, at, span.end)

    def _moved(self, state: Estimate | None, span: Span, begin: int, end: int) -> Estimate | None:
        if state is None or end == begin:
            return state
        planar, offset, variance = state
        forward, left, yaw, _ = span.mean
        span_s, noise = (end - begin) / SECOND, self.noise
        turn = complex(*cos_sin(yaw + offset))
        return Estimate(
            predicted(planar, complex(forward, left), turn, span_s, noise),
            offset,
            variance + noise.yaw_walk * noise.yaw_walk * span_s if variance else 0.0,
        )

    def _corrected(
        self, state: Estimate | None, span: Span, taken: Taken
    ) -> tuple[Estimate | None, FixReport]:
        fix, noise = taken.fix, self.noise
        place = complex(fix.x_m, fix.y_m)
        _, _, yaw, yaw_rate = span.mean
        attitude = yaw + yaw_rate * (2 * taken.at - span.begin - span.end) / 2 / SECOND
        if state is None:
            unknown = Estimate(first(place, noise), 0.0, 0.0)
            begun = unknown.planar, *_offset(unknown, fix, attitude, noise)[:2]
            return Estimate(*begun), FixReport(True, "", 0.0, 0.0, 0.0, 0.0)
        off, variance = innovation(state.planar, place, noise)
        *offset, off_yaw = _offset(state, fix, attitude, noise)
        square = (off.real * off.real + off.imag * off.imag) / variance
        report = FixReport(True, "", 0.0, off.real, off.imag, square)
        if square <= self.gate and off_yaw <= self.gate:
            return Estimate(corrected(state.planar, off, variance), *offset), report
        if not taken.may_restart:
            return state, report._replace(is_taken=False, reason=OFF_GATE)
        unknown = state._replace(offset_variance=0.0)
        again = restarted(state.planar, place, noise)
        begun_again = Estimate(again, *_offset(unknown, fix, attitude, noise)[:2])
        return begun_again, report._replace(has_begun_again=True)


def _put(fix: Taken, fixes: list[Taken]) -> None:
    """In order of origin, after those of the same instant."""
    place = len(fixes)
    while place and fixes[place - 1].at > fix.at:
        place -= 1
    fixes.insert(place, fix)


def _offset(
    state: Estimate, fix: PositionFix | PoseFix, attitude: float, noise: FilterNoise
) -> tuple[float, float, float]:
    """The offset of yaw and its variance after a fix, and the normalized square of its innovation.

    The first yaw is believed; a fix without one leaves the offset as it was.
    """
    offset, variance = state.offset_rad, state.offset_variance
    if isinstance(fix, PositionFix):
        return offset, variance, 0.0
    measured = noise.yaw_rad * noise.yaw_rad
    off = math.remainder(fix.yaw_rad - attitude - offset, math.tau)
    if not variance:
        return offset + off, measured, 0.0
    share = variance / (variance + measured)
    square = off * off / (variance + measured)
    return offset + share * off, (1.0 - share) * variance, square
