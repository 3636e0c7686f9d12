"""The bearing of TachoBot's platform: it sticks, breaks away, slides and stops."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from sim_doubles.worlds.tachobot import TachobotParameters, TachobotWorld

SECOND = 1_000_000_000
INERTIA = 0.075
FULL_MOMENT_NM = 4 * 0.40 * 0.20
DRY = TachobotParameters(static_friction_nm=0.08, coulomb_friction_nm=0.04, motor_lag_s=0.0)


class Table:
    """A world driven by the moment its propellers settle at."""

    def __init__(self, parameters: TachobotParameters) -> None:
        self.duties = [0.5] * 8
        self.world = TachobotWorld(parameters, lambda: self.duties)

    def push(self, at: int, moment_nm: float) -> None:
        self.world.advance(at)
        half = 0.5 * moment_nm / FULL_MOMENT_NM
        self.duties = [0.5 + half, 0.5 - half, 0.5 - half, 0.5 + half] * 2

    def rate(self, at: int) -> float:
        return self.world.state(at).yaw_rate_rad_s

    def yaw(self, at: int) -> float:
        return self.world.state(at).yaw_rad


@given(st.floats(-0.0799, 0.0799))
def test_a_standing_bearing_holds_any_moment_below_static_friction(moment_nm: float) -> None:
    table = Table(DRY)
    table.push(0, moment_nm)
    assert table.yaw(10 * SECOND) == 0.0
    assert table.rate(10 * SECOND) == 0.0


@pytest.mark.parametrize("moment_nm", [0.081, 0.2, -0.081, -0.3])
def test_above_static_friction_it_slides_against_coulomb_friction(moment_nm: float) -> None:
    table = Table(DRY)
    table.push(0, moment_nm)
    net = moment_nm - math.copysign(0.04, moment_nm)
    assert table.rate(SECOND) == pytest.approx(net / INERTIA)
    assert table.yaw(SECOND) == pytest.approx(0.5 * net / INERTIA)


def test_turning_it_keeps_turning_under_a_moment_that_could_not_start_it() -> None:
    table = Table(DRY)
    table.push(0, 0.06)
    assert table.rate(SECOND) == 0.0
    table.push(SECOND, 0.1)
    table.push(2 * SECOND, 0.06)
    assert table.rate(3 * SECOND) == pytest.approx((0.06 + 0.02) / INERTIA)


def test_a_moment_between_coulomb_and_static_friction_stops_it_for_good() -> None:
    table = Table(DRY)
    table.push(0, 0.1)
    table.push(SECOND, -0.06)
    assert table.rate(20 * SECOND) == 0.0
    assert table.yaw(20 * SECOND) == pytest.approx(0.5 * 0.06 / INERTIA * (1 + 0.06 / 0.1))


@given(st.floats(0.01, 0.29), st.sampled_from((1, -1)))
def test_held_exactly_at_static_friction_a_little_more_breaks_it_away(
    static_nm: float, sign: int
) -> None:
    sticky = replace(DRY, static_friction_nm=static_nm, coulomb_friction_nm=static_nm)
    table = Table(replace(sticky, motor_lag_s=0.03))
    table.push(SECOND, sign * static_nm)
    assert table.yaw(10 * SECOND) == pytest.approx(0.0, abs=1e-9)
    table.push(10 * SECOND, sign * (static_nm + 0.02))
    assert sign * table.rate(20 * SECOND) == pytest.approx(0.02 / INERTIA * (10 - 0.03))


def test_friction_belongs_to_the_platform_and_does_not_hold_a_free_body() -> None:
    table = Table(replace(DRY, mounting="free", yaw_damping_nms=0.1))
    table.push(0, 0.02)
    assert table.rate(SECOND) == pytest.approx(0.02 / INERTIA)
