"""What TachoBot's plant does: signs and sizes of equation (1), the IMU's view, refusals."""

import math
from itertools import pairwise

import pytest
from msgspec.structs import replace

from sim_doubles.worlds.tachobot import (
    Mounting,
    TachobotParameters,
    TachobotState,
    TachobotWorld,
)

SECOND = 1_000_000_000
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


def test_full_off_leaves_a_turning_body_turning() -> None:
    rig = Rig(TachobotParameters())
    rig.drive(0, 1, -1, 1, -1)
    rig.world.advance(SECOND)
    rig.duties = [0.0] * 8
    settled, later = (rig.world.state(n * SECOND).yaw_rate_rad_s for n in (3, 9))
    assert settled > 4.0
    assert later == pytest.approx(settled, rel=1e-12)


def test_the_platform_pins_x_and_y() -> None:
    turned = after_one_second(TachobotParameters(), 1, 1, 0, 0)
    assert turned[:4] == (0, 0, 0, 0)
    pushed = after_one_second(TachobotParameters(), 1, 0, 0, 0)
    assert pushed[:4] == (0, 0, 0, 0)
    assert pushed.yaw_rad > 0.4


def test_at_rest_the_imu_feels_gravity_up_and_north_ahead() -> None:
    truth = Rig(replace(FREE, mounting="platform", motor_lag_s=0.03)).world.inertial(SECOND)
    assert truth.acceleration == (0.0, 0.0, 9.80665)
    assert truth.rate == (0.0, 0.0, 0.01)
    assert truth.field == (20e-6, 0.0, -40e-6)
    assert truth.temperature_c == 25.0


def test_turned_left_the_imu_has_north_on_its_right() -> None:
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


def test_noise_belongs_to_seed_and_instant_not_to_the_readings_before() -> None:
    seldom, often = Rig(TachobotParameters()).world, Rig(TachobotParameters()).world
    for at in range(0, SECOND, 7_000_001):
        often.inertial(at)
    assert seldom.inertial(SECOND) == often.inertial(SECOND) == often.inertial(SECOND)
    other = Rig(TachobotParameters(seed=2)).world
    assert other.inertial(SECOND).rate != often.inertial(SECOND).rate
    assert seldom.inertial(SECOND + 1).rate != often.inertial(SECOND).rate


def test_the_past_is_refused_and_the_present_is_free() -> None:
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
