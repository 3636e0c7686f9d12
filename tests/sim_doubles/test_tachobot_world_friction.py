"""The bearing of TachoBot's platform: it sticks, breaks away, slides and stops."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from sim_doubles.worlds.tachobot import TachobotParameters, TachobotWorld

SECOND = 1_000_000_000
MILLISECOND = 1_000_000
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


def test_it_breaks_away_inside_a_step_when_the_growing_moment_passes_static_friction() -> None:
    table = Table(replace(DRY, motor_lag_s=0.05))
    table.push(SECOND, 0.16)
    breakaway = SECOND + round(0.05 * math.log(2.0) * SECOND)  # half of the moment is there
    assert table.yaw(breakaway - 1000) == 0.0
    assert table.rate(breakaway + MILLISECOND) == pytest.approx(
        (0.04 * 1e-3 + 0.5 * 0.08 / 0.05 * 1e-6) / INERTIA, rel=0.01
    )


def test_turning_it_keeps_turning_under_a_moment_that_could_not_start_it() -> None:
    table = Table(DRY)
    table.push(0, 0.06)
    assert table.rate(SECOND) == 0.0
    table.push(SECOND, 0.1)
    table.push(2 * SECOND, 0.06)
    assert table.rate(3 * SECOND) == pytest.approx((0.06 + 0.02) / INERTIA)


def test_without_drive_it_stops_when_coulomb_friction_has_used_its_momentum_up() -> None:
    table = Table(DRY)
    table.push(0, 0.1)
    table.push(SECOND, 0.0)  # 0.06 against, then 0.04: it stops 1.5 s later
    assert table.rate(2 * SECOND + 499 * MILLISECOND) > 0.0
    stopped = table.yaw(2 * SECOND + 501 * MILLISECOND)
    assert stopped == pytest.approx(0.5 * 0.06 / INERTIA * (1.0 + 1.5))
    assert table.rate(2 * SECOND + 501 * MILLISECOND) == 0.0
    assert table.yaw(20 * SECOND) == stopped


def test_a_moment_above_static_friction_turns_it_back_without_a_stop() -> None:
    table = Table(DRY)
    table.push(0, 0.1)
    table.push(SECOND, -0.1)  # brakes with 0.14, then drives back with 0.06
    stop = SECOND + round(0.06 / 0.14 * SECOND)
    assert table.rate(stop - MILLISECOND) > 0.0
    assert table.rate(stop + SECOND) == pytest.approx(-0.06 / INERTIA)


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


def test_viscous_damping_lets_the_rate_die_away_exponentially() -> None:
    table = Table(TachobotParameters(yaw_damping_nms=0.05, motor_lag_s=0.0))
    table.push(0, 0.2)
    assert table.rate(60 * SECOND) == pytest.approx(0.2 / 0.05)
    table.push(60 * SECOND, 0.0)
    assert table.rate(61 * SECOND) == pytest.approx(4.0 * math.exp(-0.05 / INERTIA))
    assert table.rate(1000 * SECOND) == pytest.approx(0.0, abs=1e-12)
    assert table.yaw(1000 * SECOND) == pytest.approx(0.2 / 0.05 * 60)  # all momentum is spent


def test_friction_belongs_to_the_platform_and_does_not_hold_a_free_body() -> None:
    table = Table(replace(DRY, mounting="free", yaw_damping_nms=0.1))
    table.push(0, 0.02)
    assert table.rate(SECOND) == pytest.approx(0.02 / INERTIA)
