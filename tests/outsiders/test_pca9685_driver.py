"""PCA9685-driver, as published, on the PCA9685 double: it speaks through the older smbus."""

from collections.abc import Callable
from typing import Any

import pytest
from pca9685_driver import Device, DeviceException

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.testing.wire_log import WireLog

pytestmark = pytest.mark.usefixtures("virtual_time")


@pytest.fixture
def chip(i2c_double: Callable[..., Any]) -> Pca9685Double:
    double: Pca9685Double = i2c_double("pca9685")
    return double


@pytest.fixture
def device(chip: Pca9685Double) -> Any:
    assert chip.all_off
    return Device(0x40, 1)


def test_a_value_is_the_share_of_4096_that_an_output_is_high_once_the_chip_is_awake(
    chip: Pca9685Double, device: Any, i2c_log: WireLog
) -> None:
    device.set_pwm(3, 0x234)
    assert i2c_log == ["0x40 W 14 34", "0x40 W 15 02"]
    assert chip.all_off
    device.wake()
    assert chip.duty(3) == 0x234 / 4096
    device.set_pwm_frequency(50)
    device.set_pwm(3, 1024)
    assert chip.frequency_hz == pytest.approx(50.03, abs=0.01)
    assert chip.duty(3) == 0.25
    assert device.get_pwm(3) == 1024


def test_what_is_out_of_range_does_not_get_to_the_bus(device: Any, i2c_log: WireLog) -> None:
    with pytest.raises(DeviceException):
        device.set_pwm(0, 4096)
    assert i2c_log == []
