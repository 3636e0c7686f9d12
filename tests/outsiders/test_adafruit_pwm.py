"""Adafruit's PCA9685, MotorKit and ServoKit, as published, on the PCA9685 double."""

from collections.abc import Callable
from typing import Any

import adafruit_motorkit
import adafruit_pca9685
import adafruit_servokit
import busio
import pytest

from sim_doubles.chips.pca9685 import Pca9685Double

Connect = Callable[..., Any]
pytestmark = pytest.mark.usefixtures("virtual_time")


@pytest.fixture
def chip(i2c_double: Connect) -> Pca9685Double:
    double: Pca9685Double = i2c_double("pca9685", address=0x40)
    return double


def test_a_duty_counts_once_the_frequency_is_set_and_outlives_the_driver(
    chip: Pca9685Double,
) -> None:
    with busio.I2C() as i2c, adafruit_pca9685.PCA9685(i2c) as pwm:
        pwm.channels[0].duty_cycle = 0x7FFF  # before the frequency: silently lost
        assert chip.duty(0) == 0
        pwm.frequency = 50
        pwm.channels[0].duty_cycle = 0x7FFF
        assert chip.frequency_hz == pytest.approx(50.03, abs=0.01)
    assert chip.running
    assert chip.duty(0) == pytest.approx(0.5, abs=1 / 4096)


def test_a_duty_is_one_transaction_of_six_bytes(chip: Pca9685Double, i2c_log: Any) -> None:
    pwm = adafruit_pca9685.PCA9685(busio.I2C())
    pwm.frequency = 50
    i2c_log.clear()
    for channel in pwm.channels:
        channel.duty_cycle = 0x4000
    assert [len(line.split()) for line in i2c_log] == [2 + 5] * 16
    assert set(chip.duties) == {0.25}


def test_no_chip_is_found_where_none_is(chip: Pca9685Double) -> None:
    with pytest.raises(ValueError, match="0x41"):
        adafruit_pca9685.PCA9685(busio.I2C(), address=0x41)
    assert chip.all_off


@pytest.fixture
def hat(i2c_double: Connect) -> Pca9685Double:
    double: Pca9685Double = i2c_double("pca9685", address=0x60)
    return double


@pytest.mark.parametrize(
    ("motor", "channels"),
    [
        ("motor1", (8, 9, 10)),
        ("motor2", (13, 11, 12)),
        ("motor3", (2, 3, 4)),
        ("motor4", (7, 5, 6)),
    ],
)
def test_a_throttle_is_the_duty_of_one_side_of_its_bridge_none_coasts_and_zero_brakes(
    hat: Pca9685Double, motor: str, channels: tuple[int, int, int]
) -> None:
    enable, forward, backward = channels
    driver = getattr(adafruit_motorkit.MotorKit(), motor)
    for throttle, duties in ((0.5, (0.5, 0)), (-0.25, (0, 0.25)), (None, (0, 0)), (0, (1, 1))):
        driver.throttle = throttle
        found = hat.duty(enable), hat.duty(forward), hat.duty(backward)
        assert found == pytest.approx((1.0, *duties), abs=1e-3)
    assert hat.frequency_hz == pytest.approx(1526, abs=1)


def test_a_step_of_a_stepper_turns_the_currents_by_a_quarter(hat: Pca9685Double) -> None:
    kit = adafruit_motorkit.MotorKit()
    seen = []
    for _ in range(4):
        kit.stepper1.onestep()
        seen.append(tuple(round(hat.duty(channel)) for channel in (10, 9, 11, 12)))
    assert sorted(seen) == [(0, 0, 0, 1), (0, 0, 1, 0), (0, 1, 0, 0), (1, 0, 0, 0)]


@pytest.mark.parametrize(("angle", "pulse_us"), [(0, 750), (90, 1500), (180, 2250)])
def test_a_servo_of_the_kit_gets_the_pulse_of_its_angle_and_a_continuous_one_stands_still(
    chip: Pca9685Double, angle: int, pulse_us: int
) -> None:
    kit = adafruit_servokit.ServoKit(channels=16)
    kit.servo[5].angle = angle
    kit.continuous_servo[0].throttle = 0
    for channel, expected_us in ((5, pulse_us), (0, 1500)):
        assert chip.duty(channel) / chip.frequency_hz * 1e6 == pytest.approx(expected_us, abs=10)
