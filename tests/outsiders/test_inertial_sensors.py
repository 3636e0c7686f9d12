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


class TestJmdev:
    @pytest.fixture
    def sensor(self, chip: Mpu9250Double) -> Any:
        sensor = jmdev.MPU9250()
        sensor.configure()
        assert chip.samples > 0
        return sensor

    def test_acceleration_rate_and_temperature(self, sensor: Any) -> None:
        acceleration = np.array(sensor.readAccelerometerMaster()) * G
        assert acceleration == pytest.approx(ACCELERATION, abs=G * 16 / 32768)
        rate = np.radians(sensor.readGyroscopeMaster())
        assert rate == pytest.approx(RATE, abs=math.radians(2000 / 32768))
        assert sensor.readTemperatureMaster() == pytest.approx(30.0, abs=0.01)

    def test_the_magnetic_field(self, sensor: Any) -> None:
        field = np.array(sensor.readMagnetometerMaster()) * 1e-6
        assert field == pytest.approx(AS_THE_DIE_LIES, abs=0.3e-6)

    def test_an_absent_chip_is_read_as_zeros(
        self, sensor: Any, chip: Mpu9250Double, i2c_faults: FaultScript
    ) -> None:
        i2c_faults.add(AbsentTarget(target=chip))
        assert sensor.readAccelerometerMaster() == [0, 0, 0]
        assert i2c_faults.count() == 1


class TestFaBo:
    @pytest.fixture
    def sensor(self, chip: Mpu9250Double) -> Any:
        sensor = fabo.MPU9250()
        assert chip.samples > 0
        return sensor

    def test_all_nine_axes(self, sensor: Any, virtual_time: VirtualTime) -> None:
        virtual_time.sleep(0.2)  # a measurement of the magnetometer
        assert sensor.searchDevice()
        acceleration, rate, field = sensor.readAccel(), sensor.readGyro(), sensor.readMagnet()
        assert [acceleration[axis] * G for axis in "xyz"] == pytest.approx(ACCELERATION, abs=0.01)
        assert np.radians([rate[axis] for axis in "xyz"]) == pytest.approx(RATE, abs=1e-3)
        assert [field[axis] * 1e-6 for axis in "xyz"] == pytest.approx(AS_THE_DIE_LIES, abs=0.3e-6)
        assert sensor.readTemperature() == pytest.approx(30.0, abs=0.01)


class TestImusensor:
    @pytest.fixture
    def sensor(self, chip: Mpu9250Double) -> Any:
        sensor = imusensor.MPU9250.MPU9250.MPU9250(smbus.SMBus(1), 0x68)
        sensor.begin()
        assert chip.samples > 0
        return sensor

    def test_its_calibration_takes_the_seconds_it_sleeps(
        self, sensor: Any, virtual_time: VirtualTime
    ) -> None:
        assert 3 < virtual_time.now_s < 8
        assert sensor.GyroBias == pytest.approx([RATE[1], RATE[0], -RATE[2]], abs=1e-3)

    def test_acceleration_in_axes_of_its_own(self, sensor: Any) -> None:
        sensor.readSensor()
        x, y, z = ACCELERATION
        assert sensor.AccelVals == pytest.approx([y, x, -z], abs=0.02)
        assert sensor.GyroVals == pytest.approx([0, 0, 0], abs=1e-3)
