"""Three published drivers of the MPU-9250 on its double, moving: what they read, in SI."""

import math
from collections.abc import Callable
from typing import Any

import FaBo9Axis_MPU9250 as fabo
import imusensor.MPU9250.MPU9250
import numpy as np
import pytest
import smbus
from mpu9250_jmdev import mpu_9250 as jmdev

from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.inertial_truth import InertialTruth
from sim_doubles.testing.virtual_time import VirtualTime

G = 9.80665
ACCELERATION = (1.0, -2.0, 9.0)
RATE = (0.1, -0.2, 0.3)
FIELD = (20e-6, -10e-6, 35e-6)
AS_THE_DIE_LIES = (FIELD[1], FIELD[0], -FIELD[2])
"""The magnetometer's axes in its package; these drivers leave them as they are."""


@pytest.fixture
def chip(virtual_time: VirtualTime, i2c_double: Callable[..., Any]) -> Mpu9250Double:
    assert virtual_time.now_s == 0
    double: Mpu9250Double = i2c_double(
        "mpu9250", inertia=InertialTruth(ACCELERATION, RATE, FIELD, 30.0), noise_seed=None
    )
    return double


@pytest.fixture
def jmdev_sensor(chip: Mpu9250Double) -> Any:
    sensor = jmdev.MPU9250()
    sensor.configure()
    assert chip.samples > 0
    return sensor


def test_jmdev_reads_all_nine_axes_and_the_temperature(jmdev_sensor: Any) -> None:
    acceleration = np.array(jmdev_sensor.readAccelerometerMaster()) * G
    assert acceleration == pytest.approx(ACCELERATION, abs=G * 16 / 32768)
    rate = np.radians(jmdev_sensor.readGyroscopeMaster())
    assert rate == pytest.approx(RATE, abs=math.radians(2000 / 32768))
    assert jmdev_sensor.readTemperatureMaster() == pytest.approx(30.0, abs=0.01)
    field = np.array(jmdev_sensor.readMagnetometerMaster()) * 1e-6
    assert field == pytest.approx(AS_THE_DIE_LIES, abs=0.3e-6)


def test_jmdev_reads_an_absent_chip_as_zeros(
    jmdev_sensor: Any, chip: Mpu9250Double, i2c_faults: FaultScript
) -> None:
    i2c_faults.add(AbsentTarget(target=chip))
    assert jmdev_sensor.readAccelerometerMaster() == [0, 0, 0]
    assert i2c_faults.count() == 1


def test_fabo_reads_all_nine_axes(chip: Mpu9250Double, virtual_time: VirtualTime) -> None:
    sensor = fabo.MPU9250()
    assert chip.samples > 0
    virtual_time.sleep(0.2)  # a measurement of the magnetometer
    assert sensor.searchDevice()
    acceleration, rate, field = sensor.readAccel(), sensor.readGyro(), sensor.readMagnet()
    assert [acceleration[axis] * G for axis in "xyz"] == pytest.approx(ACCELERATION, abs=0.01)
    assert np.radians([rate[axis] for axis in "xyz"]) == pytest.approx(RATE, abs=1e-3)
    assert [field[axis] * 1e-6 for axis in "xyz"] == pytest.approx(AS_THE_DIE_LIES, abs=0.3e-6)
    assert sensor.readTemperature() == pytest.approx(30.0, abs=0.01)


def test_imusensor_calibrates_for_the_seconds_it_sleeps_and_reads_in_axes_of_its_own(
    chip: Mpu9250Double, virtual_time: VirtualTime
) -> None:
    sensor = imusensor.MPU9250.MPU9250.MPU9250(smbus.SMBus(1), 0x68)
    sensor.begin()
    assert chip.samples > 0
    assert 3 < virtual_time.now_s < 8
    assert sensor.GyroBias == pytest.approx([RATE[1], RATE[0], -RATE[2]], abs=1e-3)
    sensor.readSensor()
    x, y, z = ACCELERATION
    assert sensor.AccelVals == pytest.approx([y, x, -z], abs=0.02)
    assert sensor.GyroVals == pytest.approx([0, 0, 0], abs=1e-3)
