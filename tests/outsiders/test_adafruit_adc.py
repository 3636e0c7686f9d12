"""Adafruit's ADS1x15, as published, on the ADS1115 double."""

from collections.abc import Callable
from typing import Any

import adafruit_ads1x15
import busio
import pytest

from sim_doubles.testing.virtual_time import VirtualTime

VOLTS = (1.2, -0.5, 3.3, 0.0)


@pytest.fixture
def converter(virtual_time: VirtualTime, i2c_double: Callable[..., Any]) -> Any:
    assert virtual_time.now_s == 0
    i2c_double("ads1115", inputs=VOLTS)
    return adafruit_ads1x15.ADS1115(busio.I2C())


@pytest.mark.parametrize("pin", [0, 2, 3])
def test_a_voltage_within_a_step_of_the_scale(converter: Any, pin: int) -> None:
    channel = adafruit_ads1x15.AnalogIn(converter, pin)
    assert channel.voltage == pytest.approx(VOLTS[pin], abs=4.096 / 32768)


def test_a_difference_of_two_inputs(converter: Any) -> None:
    channel = adafruit_ads1x15.AnalogIn(converter, 0, 1)
    assert channel.voltage == pytest.approx(1.7, abs=4.096 / 32768)


def test_a_conversion_takes_its_time(converter: Any, virtual_time: VirtualTime) -> None:
    before = virtual_time()
    assert adafruit_ads1x15.AnalogIn(converter, 0).value > 0
    assert virtual_time() - before > 1_000_000_000 / 128
