"""Drivers that open their bus in the body of their module, imported while pytest collects."""

from collections.abc import Callable
from typing import Any

import FaBo9Axis_MPU9250 as fabo
import pytest
import smbus
import smbus2

from sim_doubles.testing.virtual_time import VirtualTime

OPENED = [smbus2.SMBus(1), smbus.SMBus("/dev/i2c-1")]
"""As a class body or a module of a driver does it."""


@pytest.mark.parametrize("time", range(2))
def test_the_bus_is_each_tests_own(
    virtual_time: VirtualTime, i2c_double: Callable[..., Any], time: int
) -> None:
    chip = i2c_double("mpu9250")
    assert fabo.MPU9250().searchDevice()
    assert chip.samples > 0
    assert virtual_time.now_s < 1, time


@pytest.mark.parametrize("bus", OPENED)
def test_whichever_library_it_is_of(i2c_double: Callable[..., Any], bus: Any) -> None:
    i2c_double("pca9685")
    assert bus.read_byte_data(0x40, 0xFE) == 0x1E


@pytest.mark.parametrize("bus", OPENED)
def test_without_a_test_that_plugs_it_in_it_fails(bus: Any) -> None:
    with pytest.raises(OSError, match=" "):
        bus.read_byte_data(0x40, 0xFE)


def test_a_bus_that_a_test_opens_must_be_there() -> None:
    for opens in (smbus.SMBus, smbus2.SMBus):
        with pytest.raises(FileNotFoundError):
            opens(987)
