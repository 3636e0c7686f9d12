"""Raw counts that repeat themselves by chance or not, and the bias of a robot at rest."""

import math

import pytest
from firmware_drivers.chips.liveness import LEAST_ODDS, Liveness, MeanSquare, fresh_noise
from firmware_drivers.gyro_bias import GyroBias

from firmware_runtime.hal.wire_errors import Fault, Implausible, NotReady, Stuck
from sim_doubles.worlds.noise import InstantNoise

DEVIATION = 3.0


def noisy(at: int) -> tuple[int, int, int]:
    x, y, z = InstantNoise("part", 1, 2 * DEVIATION).at(at)
    return (round(x), round(y), round(z))


def liveness(*, repeats: int = 1) -> Liveness:
    return Liveness("part", "xyz", (DEVIATION,) * 3, repeats=repeats)


def readings_until_stuck(check: Liveness, axes: int) -> tuple[int, Stuck]:
    """Readings of which that many axes stand still from the first on."""
    for at in range(1000):
        counts = (7,) * axes + noisy(at)[axes:]
        try:
            check.check(counts)
        except Stuck as error:
            return at + 1, error
    pytest.fail("never stuck")


@pytest.mark.parametrize("axes", [1, 2, 3])
def test_axes_that_stand_still_together_are_found_by_the_product_of_their_odds(axes: int) -> None:
    odds = 1 / (DEVIATION * math.sqrt(math.tau))
    least = math.log(LEAST_ODDS) / math.log(odds) / axes
    found, error = readings_until_stuck(liveness(), axes)
    assert least < found - 1 <= least + 2
    assert error.axis == ", ".join("xyz"[:axes])
    assert (error.value, error.readings) == (7, found)


def test_one_reading_that_lives_ends_it_and_after_a_restart_it_has_to_change() -> None:
    check = liveness()
    readings_until_stuck(check, 3)
    check.check((1, 2, 3))
    check.check((4, 5, 6))
    readings_until_stuck(check, 3)
    check.restart()
    for _ in range(5):
        with pytest.raises(Stuck):
            check.check((0, 0, 0))
    check.check((1, 2, 3))


def test_measurements_that_are_read_often_repeat_themselves_honestly() -> None:
    check = liveness(repeats=4)
    for at in range(4000):
        check.check(noisy(at // 4))


@pytest.mark.parametrize("value", [0, 1])
def test_a_bit_within_the_noise_that_never_changes_is_stuck(value: int) -> None:
    check = liveness()
    counts = [(x, y, z & ~2 | value << 1) for x, y, z in map(noisy, range(1000))]
    with pytest.raises(Stuck) as caught:
        list(map(check.check, counts))
    assert (caught.value.axis, caught.value.value) == ("z bit 1", value)


def test_an_axis_quieter_than_its_least_bit_is_never_stuck_and_a_low_pass_leaves_less() -> None:
    check = Liveness("part", "x", (0.3,))
    for _ in range(10_000):
        check.check((5,))
    assert fresh_noise(2.0, 92.0, 10.0) == pytest.approx(1.0)
    assert fresh_noise(2.0, 5.0, 1000.0) == pytest.approx(math.sqrt(1 - math.exp(-0.02 * math.pi)))


@pytest.mark.parametrize("axis", range(3))
def test_a_mean_beyond_its_limits_is_implausible_until_a_reading_is_within(axis: int) -> None:
    check = MeanSquare("part", "force", "g", scale=0.001, limits=(0.6, 1.6), readings=10)
    weak, strong = (tuple(size * (each == axis) for each in range(3)) for size in (1000, 2000))
    for _ in range(9):
        check.check(*strong)
    for readings in (10, 11, 12):
        with pytest.raises(Implausible) as caught:
            check.check(*strong)
        assert (caught.value.value, caught.value.readings) == (2.0, readings)
    for _ in range(100):
        check.check(*weak)


def test_a_push_is_no_mean() -> None:
    check = MeanSquare("part", "force", "g", scale=0.001, limits=(0.6, 1.6), readings=100)
    for at in range(1000):
        check.check(0, 0, 4000 if at % 100 < 5 else 1000)


Rate = tuple[float, float, float]


def bias_of(*rates: Rate) -> GyroBias:
    bias = GyroBias(2)
    for rate in rates:
        bias.add(rate)
    return bias


def test_the_bias_is_the_mean_of_a_robot_at_rest() -> None:
    bias = GyroBias(4)
    for z in (0.01, 0.03, 0.01, 0.03):
        assert not bias.is_complete
        bias.add((0.08, -0.05, z))
    assert bias.is_complete
    assert bias.mean() == pytest.approx((0.08, -0.05, 0.02))


TURNS = "the robot turns"


@pytest.mark.parametrize(
    ("rates", "reason"),
    [
        pytest.param(
            [(0.0, 0.0, 0.0), (0.0, 0.2, 0.0)],
            r"about y spreads over 0\.200 rad/s, expected 0\.05 at most",
            id="a robot that moved",
        ),
        pytest.param([(0.0, 0.0, -1.0)] * 2, rf"about z is -1\.000 rad/s, .*{TURNS}", id="a turn"),
        pytest.param([(0.0, 0.09, 0.0)] * 2, rf"mean rate about y .*{TURNS}", id="a slow turn"),
        pytest.param([(0.0, 0.35, 0.0)] * 2, rf"mean rate about y .*{TURNS}", id="a quick turn"),
        pytest.param([(0.0, 0.0, 0.0)], "1 samples; expected 2", id="too few samples"),
        pytest.param(
            [(0.0, 0.0, 0.0), (math.nan, 0.0, 0.0)],
            "rate|mean|spread",
            id="a rate that is no number",
        ),
    ],
)
def test_what_is_no_rest_is_refused(rates: list[Rate], reason: str) -> None:
    with pytest.raises(NotReady, match=reason):
        bias_of(*rates).mean()


def test_a_restart_forgets_the_motion_and_one_sample_is_no_bias() -> None:
    bias = bias_of((5.0, 0.0, 0.0))
    bias.restart()
    for _ in range(2):
        bias.add((0.01, 0.0, 0.0))
    assert bias.mean() == pytest.approx((0.01, 0.0, 0.0))
    with pytest.raises(ValueError, match="1 samples, expected 2 or more"):
        GyroBias(1)


def test_a_field_that_turns_contradicts_a_gyro_that_hides_it() -> None:
    """A third of a radian a second, for half a second at 100 Hz."""
    bias = GyroBias(50)
    for number in range(50):
        angle = 0.35 * number / 100
        bias.add((0.0, 0.0, 0.01), (20e-6 * math.cos(angle), -20e-6 * math.sin(angle), -40e-6))
    with pytest.raises(NotReady, match=rf"the field changed .*{TURNS}, whatever its gyro"):
        bias.mean()


def test_a_fault_says_how_long_a_reading_was_dead_and_nothing_of_any_other() -> None:
    dead = Implausible("ADS1115", "A0", 9.0, "less")
    assert Fault.of(dead, 1, 7) == ("Implausible", str(dead), 1, "A0", 9.0, 7)
    assert Fault.of(NotReady("no answer"), 2, 7) == ("NotReady", "no answer", 2, "", 0.0, 0)


@pytest.mark.slow
def test_a_field_with_its_noise_contradicts_nothing() -> None:
    noise = InstantNoise("field", 1, 0.3e-6)
    for begin in range(0, 100_000, 50):
        bias = GyroBias(50)
        for at in range(begin, begin + 50):
            x, y, z = noise.at(at)
            bias.add((0.0, 0.0, 0.01), (20e-6 + x, y, -40e-6 + z))
        bias.mean()
