"""What TachoBot's plant does: equation (1), friction of its bearing, propellers, the IMU's view."""

import math
import statistics
from itertools import pairwise
from typing import Any

import pytest
from firmware_boards.tachobot.plant_settings import PositionSensorSettings
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.position_fix import PoseFix, PositionFix
from sim_doubles.inertial_truth import ChipAxes, Vector
from sim_doubles.worlds.position_sensor import PositionSensor, TruePose
from sim_doubles.worlds.propellers import PropellerPairs
from sim_doubles.worlds.tachobot import (
    Mounting,
    TachobotParameters,
    TachobotState,
    TachobotWorld,
)
from tests.support.executives import Run
from tests.support.stalling_clock import StallingClock
from tests.support.virtual_tachobot import virtual_tachobot

NEUTRAL = (0.5,) * 8
FREE = TachobotParameters(
    mounting="free",
    motor_lag_s=0.0,
    gyro_noise_rad_s=0.0,
    field_noise_t=0.0,
    accelerometer_noise_m_s2=0.0,
)


def differential(*pairs: float) -> list[float]:
    """Duties of the four pairs about one half."""
    return [duty for u in pairs for duty in (0.5 + u / 2, 0.5 - u / 2)]


class Rig:
    """A world and the duties it is driven with."""

    def __init__(self, parameters: TachobotParameters) -> None:
        self.duties: list[float] = list(NEUTRAL)
        self.asked = 0
        self.world = TachobotWorld(parameters, self._ask)

    def _ask(self) -> list[float]:
        self.asked += 1
        return self.duties

    def drive(self, at: int, *pairs: float) -> None:
        self.world.advance(at)
        self.duties = differential(*pairs)


def after_one_second(parameters: TachobotParameters, *pairs: float) -> TachobotState:
    rig = Rig(parameters)
    rig.drive(0, *pairs)
    return rig.world.state(SECOND)


@pytest.mark.parametrize(
    ("pairs", "forward", "left", "turning"),
    [
        ((1, 0, 0, 0), 1, 0, 1),
        ((0, 1, 0, 0), 0, -1, -1),
        ((0, 0, 1, 0), -1, 0, 1),
        ((0, 0, 0, 1), 0, 1, -1),
    ],
    ids=["f1", "f2", "f3", "f4"],
)
def test_each_force_pushes_and_turns_as_equation_1_says(
    pairs: tuple[float, ...], forward: int, left: int, turning: int
) -> None:
    rig = Rig(FREE)
    rig.drive(0, *pairs)
    moved = rig.world.state(SECOND // 1000)
    push = 0.40 / 3.0 * 1e-3
    assert moved.vx_m_s == pytest.approx(forward * push, abs=1e-6)
    assert moved.vy_m_s == pytest.approx(left * push, abs=1e-6)
    felt = rig.world.motion(SECOND // 1000).acceleration
    assert felt == pytest.approx((forward * 0.40 / 3.0, left * 0.40 / 3.0, 9.80665))
    assert moved.yaw_rate_rad_s == pytest.approx(turning * 0.20 / 0.075 * 0.40 * 1e-3)


def test_the_third_command_accelerates_yaw_by_twice_its_lever_over_the_inertia() -> None:
    command_n = 0.1
    quarter = command_n / 2 / 0.40  # the pseudo-inverse of T gives each pair half of the command
    turned = after_one_second(
        replace(FREE, mounting="platform"), quarter, -quarter, quarter, -quarter
    )
    assert turned.yaw_rate_rad_s == pytest.approx(2 * 0.20 / 0.075 * command_n)


@pytest.mark.parametrize("mounting", ["platform", "free"])
@pytest.mark.parametrize("duty", [0.0, 0.5, 1.0], ids=["full-off", "neutral", "all full"])
def test_equal_duties_move_nothing(mounting: Mounting, duty: float) -> None:
    rig = Rig(TachobotParameters(mounting=mounting))
    rig.duties = [duty] * 8
    assert rig.world.state(SECOND) == TachobotState(0, 0, 0, 0, 0, 0)


def test_what_pushes_a_body_that_turns_leads_it_round_as_the_integral_says() -> None:
    rig = Rig(FREE)
    rig.drive(0, 1, 0, 1, 0)
    rig.drive(SECOND, 1, 1, 0, 0)
    begun, moved = rig.world.state(SECOND), rig.world.state(3 * SECOND)
    rate, push = begun.yaw_rate_rad_s, 0.40 / 3.0 / begun.yaw_rate_rad_s
    sine, cosine = (math.sin(moved.yaw_rad), math.cos(moved.yaw_rad))
    sine_before, cosine_before = (math.sin(begun.yaw_rad), math.cos(begun.yaw_rad))
    assert moved.yaw_rad == pytest.approx(begun.yaw_rad + 2.0 * rate)
    assert (begun.vx_m_s, begun.vy_m_s) == pytest.approx((0.0, 0.0), abs=1e-12)
    expected = (
        push * (sine - sine_before - cosine + cosine_before),
        push * (-cosine + cosine_before - sine + sine_before),
    )
    assert (moved.vx_m_s, moved.vy_m_s) == pytest.approx(expected, abs=1e-11)
    radius = push / rate
    way = (
        radius * (cosine_before - cosine + sine_before - sine)
        + 2.0 * push * (cosine_before - sine_before),
        radius * (sine_before - sine + cosine - cosine_before)
        + 2.0 * push * (cosine_before + sine_before),
    )
    assert (moved.x_m - begun.x_m, moved.y_m - begun.y_m) == pytest.approx(way, abs=1e-11)


def test_full_off_leaves_a_turning_body_turning_and_the_platform_pins_x_and_y() -> None:
    rig = Rig(TachobotParameters())
    rig.drive(0, 1, -1, 1, -1)
    rig.world.advance(SECOND)
    rig.duties = [0.0] * 8
    settled, later = (rig.world.state(n * SECOND).yaw_rate_rad_s for n in (3, 9))
    assert settled > 4.0
    assert later == pytest.approx(settled, rel=1e-12)
    turned = after_one_second(TachobotParameters(), 1, 1, 0, 0)
    assert turned[:4] == (0, 0, 0, 0)
    pushed = after_one_second(TachobotParameters(), 1, 0, 0, 0)
    assert pushed[:4] == (0, 0, 0, 0)
    assert pushed.yaw_rad > 0.4


def test_the_imu_feels_gravity_up_and_north_ahead_or_on_its_right() -> None:
    truth = Rig(replace(FREE, mounting="platform", motor_lag_s=0.03)).world.inertial(SECOND)
    assert truth.acceleration == (0.0, 0.0, 9.80665)
    assert truth.rate == (0.0, 0.0, 0.01)
    assert truth.field == (20e-6, 0.0, -40e-6)
    assert truth.temperature_c == 25.0
    rig = Rig(replace(FREE, mounting="platform"))
    rig.drive(0, 1, -1, 1, -1)
    at = round(math.sqrt(math.pi / (4 * 0.20 / 0.075 * 0.40)) * SECOND)
    truth = rig.world.inertial(at)
    assert rig.world.state(at).yaw_rad == pytest.approx(math.pi / 2)
    assert truth.field == pytest.approx((0.0, -20e-6, -40e-6), abs=1e-12)
    assert truth.rate[2] == pytest.approx(rig.world.state(at).yaw_rate_rad_s + 0.01)


def test_gyro_noise_has_its_mean_its_deviation_and_no_memory() -> None:
    world = Rig(TachobotParameters(gyro_bias_rad_s=0.0, gyro_noise_rad_s=0.5)).world
    samples = [world.inertial(at).rate for at in range(0, 4000 * 1_000_000, 1_000_000)]
    for axis in zip(*samples, strict=True):
        count = len(axis)
        deviation = math.sqrt(sum(value * value for value in axis) / count)
        memory = sum(a * b for a, b in pairwise(axis)) / count
        assert abs(sum(axis) / count) < 5 * 0.5 / math.sqrt(count)
        assert deviation == pytest.approx(0.5, rel=0.05)
        assert abs(memory) < 5 * 0.25 / math.sqrt(count)
    across = sum(x * y for x, y, _ in samples) / len(samples)
    assert abs(across) < 5 * 0.25 / math.sqrt(len(samples))


def test_noise_belongs_to_seed_and_instant_and_the_past_is_refused() -> None:
    seldom, often = Rig(TachobotParameters()).world, Rig(TachobotParameters()).world
    for at in range(0, SECOND, 7_000_001):
        often.inertial(at)
    assert seldom.inertial(SECOND) == often.inertial(SECOND) == often.inertial(SECOND)
    other = Rig(TachobotParameters(seed=2)).world
    assert other.inertial(SECOND).rate != often.inertial(SECOND).rate
    assert seldom.inertial(SECOND + 1).rate != often.inertial(SECOND).rate
    rig = Rig(TachobotParameters())
    rig.world.advance(SECOND)
    asked = rig.asked
    rig.world.advance(SECOND)
    assert rig.asked == asked
    with pytest.raises(ValueError, match=r"0\.999999999 s .* 1\.000000000 s"):
        rig.world.advance(SECOND - 1)


@pytest.mark.parametrize(
    "duties",
    [[0.5] * 7, [0.5] * 9, [0.5] * 7 + [1.1], [-0.1] + [0.5] * 7, [math.nan] + [0.5] * 7],
    ids=["seven", "nine", "over one", "negative", "not a number"],
)
def test_duties_that_are_not_eight_from_0_to_1_are_refused(duties: list[float]) -> None:
    rig = Rig(TachobotParameters())
    rig.duties = duties
    with pytest.raises(ValueError, match="expected eight from 0 to 1"):
        rig.world.advance(1)


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


def test_friction_stops_it_for_good_or_leaves_it_turning_under_what_could_not_start_it() -> None:
    table = Table(DRY)
    table.push(0, 0.06)
    assert table.rate(SECOND) == 0.0
    table.push(SECOND, 0.1)
    table.push(2 * SECOND, 0.06)
    assert table.rate(3 * SECOND) == pytest.approx((0.06 + 0.02) / INERTIA)
    table = Table(DRY)
    table.push(0, 0.1)
    table.push(SECOND, -0.06)
    assert table.rate(20 * SECOND) == 0.0
    assert table.yaw(20 * SECOND) == pytest.approx(0.5 * 0.06 / INERTIA * (1 + 0.06 / 0.1))
    table = Table(replace(DRY, mounting="free", yaw_damping_nms=0.1))
    table.push(0, 0.02)
    assert table.rate(SECOND) == pytest.approx(0.02 / INERTIA)


@pytest.mark.parametrize("pushes", [(0.5,), (-0.5,), (0.3, -0.5), (-0.3, 0.5), (0.5, -0.3)])
def test_friction_brakes_a_body_that_was_pushed_until_its_bearing_sticks(
    pushes: tuple[float, ...],
) -> None:
    world = Table(DRY).world
    for each in pushes:
        world.push(each)
    rate, braking = sum(pushes), 0.04 / INERTIA
    assert world.state(SECOND // 10).yaw_rate_rad_s == pytest.approx(
        rate - math.copysign(0.1 * braking, rate)
    )
    assert world.state(9 * SECOND).yaw_rate_rad_s == 0.0
    assert world.state(9 * SECOND).yaw_rad == pytest.approx(rate * abs(rate) / (2 * braking))


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


duties = st.floats(0.0, 1.0)
spans = st.floats(0.0, 0.2)


@pytest.mark.slow
@given(st.lists(st.tuples(duties, duties, spans), min_size=1, max_size=6), st.floats(0.1, 20.0))
def test_pairs_that_push_alike_turn_as_four_pairs_do(
    pushes: list[tuple[float, float, float]], thrust_n: float
) -> None:
    pairs, plain = PropellerPairs(thrust_n, 0.03), PropellerPairs(thrust_n, 0.03)
    for duty, back, elapsed_s in pushes:
        for each in (pairs, plain):
            each.hold((duty, back, back, duty, duty, back, back, duty))
        force = plain.turning(2.7)
        plain.advance(elapsed_s)
        assert pairs._only_turns
        assert pairs.turn_for(2.7, elapsed_s) == (force.settled, force.single, force.double)
        assert pairs._speeds == plain._speeds


@given(st.lists(duties, min_size=8, max_size=8), spans)
def test_a_pair_that_pushes_otherwise_is_seen(first: list[float], elapsed_s: float) -> None:
    pairs, plain = PropellerPairs(0.4, 0.03), PropellerPairs(0.4, 0.03)
    for held in (first, [0.6, 0.4, 0.4, 0.6] * 2):
        for each in (pairs, plain):
            each.hold(held)
        force = plain.turning(1.0)
        plain.advance(elapsed_s)
        assert pairs.turn_for(1.0, elapsed_s) == (force.settled, force.single, force.double)
        assert pairs._speeds == plain._speeds


@pytest.mark.parametrize(
    ("mounting", "felt"),
    [
        ("+x +y +z", (1.0, 2.0, 3.0)),
        ("+y -x +z", (-2.0, 1.0, 3.0)),  # its y axis lies along the body's x axis
        ("+z +x -y", (2.0, -3.0, 1.0)),
    ],
)
def test_a_chip_feels_along_its_own_axes(mounting: str, felt: Vector) -> None:
    axes = ChipAxes(mounting)
    assert axes.turn_vector((1.0, 2.0, 3.0)) == felt
    assert axes.is_identity == (mounting == "+x +y +z")


DELAY_S = 0.12
PLAIN = PositionSensorSettings(delay_s=DELAY_S, noise_m=0.0, yaw_noise_rad=0.0)


def sent(
    until_s: float, ahead: int = 0, *, port: str = "position", **changes: object
) -> list[tuple[int, Any]]:
    """What a sensor sends of a body that moves along x at 1 m/s; its world may run ahead."""
    parameters = replace(PLAIN, **changes)
    top = Coupled("top")
    clock: list[Simulator] = []

    def now() -> int:
        return (clock[0].now if clock else 0) + ahead

    sensor = top.add(PositionSensor(parameters, lambda: TruePose(now() / SECOND, 2.0, 0.1), now))
    simulator = Simulator(top, checked=True)
    clock.append(simulator)
    found: list[tuple[int, Any]] = []
    simulator.listen(sensor.out_ports[port], lambda at, value: found.append((at, value)))
    simulator.run(round(until_s * SECOND))
    return found


@pytest.mark.parametrize("ahead", [0, 700_000])
def test_a_position_comes_a_delay_after_it_was_measured_and_says_so(ahead: int) -> None:
    found = sent(2.0, ahead)
    assert [at for at, _ in found[:3]] == [170 * MILLISECOND, 220 * MILLISECOND, 270 * MILLISECOND]
    for at, fix in found:
        assert fix.x_m == pytest.approx(at / SECOND - fix.age_s)
        assert fix.y_m == 2.0


def test_a_loop_that_stood_still_gets_every_position_all_the_same() -> None:
    top = Coupled("top")
    sensor = top.add(PositionSensor(PLAIN, lambda: TruePose(1.0, 2.0, 0.1), lambda: 0))
    run = Run(top, StallingClock({3: 300 * MILLISECOND}))
    found: list[PositionFix] = []
    run.executive.simulator.listen(sensor.position, lambda _at, value: found.append(value))
    run.until(SECOND)
    assert len(found) == len(sent(1.0))


def test_without_delay_it_comes_at_once() -> None:
    assert sent(0.06, delay_s=0.0) == [(50 * MILLISECOND, PositionFix(0.05, 2.0, 0.0))]
    ((_, seen),) = sent(0.06, port="pose", delay_s=0.0)
    assert seen == PoseFix(0.05, 2.0, 0.1, 0.0)


def test_the_stated_share_is_dropped_by_seed() -> None:
    first, again, other = (sent(12.0, dropout=0.3, seed=seed) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len(first) / 238 == pytest.approx(0.7, abs=0.04)
    assert sent(10.0, dropout=1.0) == []


@pytest.mark.parametrize(("yaw", "port"), [("false", "position"), ("true", "pose")])
def test_the_robot_gets_what_the_sensor_sees_of_it(yaw: str, port: str) -> None:
    robot = virtual_tachobot("controller.mode=track", f"world.position.yaw={yaw}")
    robot.run(0.3)
    seen = robot.received[f"position_sensor.{port}"]
    assert robot.received[f"position_input.{port}"] == seen != []


def test_in_an_outage_nothing_is_measured() -> None:
    origins = [at - DELAY_S * SECOND for at, _ in sent(5.0, outages_s=((1.0, 3.0),))]
    assert not any(SECOND <= at < 3 * SECOND for at in origins)
    assert len(origins) == 97 - 40


def test_the_noise_is_as_large_as_stated() -> None:
    offs = [fix.y_m - 2.0 for _, fix in sent(30.0, noise_m=0.02)]
    assert statistics.stdev(offs) == pytest.approx(0.02, rel=0.06)
    assert abs(statistics.mean(offs)) < 0.02 * 4 / math.sqrt(len(offs))
