import math

import pytest
from firmware_drivers.gyro_bias import GyroBias

from firmware_runtime.hal.wire_errors import NotReady
from sim_doubles.worlds.noise import InstantNoise

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


def test_restarting_forgets_the_motion() -> None:
    bias = bias_of((5.0, 0.0, 0.0))
    bias.restart()
    for _ in range(2):
        bias.add((0.01, 0.0, 0.0))
    assert bias.mean() == pytest.approx((0.01, 0.0, 0.0))


def test_a_bias_of_one_sample_cannot_be_asked_for() -> None:
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


@pytest.mark.slow
def test_a_field_with_its_noise_contradicts_nothing() -> None:
    noise = InstantNoise("field", 1, 0.3e-6)
    for begin in range(0, 100_000, 50):
        bias = GyroBias(50)
        for at in range(begin, begin + 50):
            x, y, z = noise.at(at)
            bias.add((0.0, 0.0, 0.01), (20e-6 + x, y, -40e-6 + z))
        bias.mean()
