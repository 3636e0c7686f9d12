"""Rows of the chip contract for TachoBot's chips."""

import math
from collections.abc import Iterator, Sequence

from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.contract.row import MILLISECOND, Row, Vector, each
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth


class Pca9685Row(Row):
    name = "pca9685"
    address = 0x41
    wrong_identity = (0x05, 0x61)

    def build(self) -> Sequence[Target]:
        self.double = Pca9685Double(self.clock, self.address)
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Pca9685(self.bus, self.address)
        return self.driver.bring_up(1000)

    def use(self) -> None:
        self.driver.set_duties(0, (0.5,) * 8)

    def verify(self) -> None:
        self.driver.verify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for numerator in range(101):
            duty = numerator / 100
            for channel in (0, 7, 15):
                (written,) = self.driver.set_duties(channel, (duty,))
                yield duty, written, 0.5 / 4096
                yield written, self.double.duty(channel), 0.0

    def warnings(self) -> list[str]:
        return list(self.double.warnings)


class Mpu9250Row(Row):
    name = "mpu9250"
    address = 0x69
    wrong_identity = (0x75, 0x68)

    def build(self) -> Sequence[Target]:
        self.truth = InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), (20e-6, 0, -40e-6), 25.0)
        self.magnetometer = Ak8963Double(self.clock, lambda _: self.truth.field, noise_seed=None)
        self.double = Mpu9250Double(
            self.clock,
            lambda _: self.truth,
            self.address,
            magnetometer=self.magnetometer,
            noise_seed=None,
        )
        return [self.double, self.magnetometer]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Mpu9250(self.bus, self.address)
        return self.driver.bring_up()

    def use(self) -> None:
        self.clock.advance(10 * MILLISECOND)
        self.driver.read_sample()

    def verify(self) -> None:
        self.driver.verify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for share in (-0.99, -0.5, -0.001, 0.0, 0.001, 0.3, 0.99):
            acceleration = (share * 4 * 9.80665, 1.0, -share * 4 * 9.80665)
            rate = (-2.0, share * math.radians(500), -share * math.radians(500))
            field = (share * 2000e-6, -share * 1000e-6, 500e-6 - share * 1000e-6)
            self.truth = InertialTruth(acceleration, rate, field, 25 + 40 * share)
            self.clock.advance(1000 * MILLISECOND)
            sample = self.driver.read_sample()
            assert sample.field is not None
            yield from each(acceleration, sample.acceleration, 4 * 9.80665 / 32768)
            yield from each(rate, sample.rate, math.radians(500) / 32768)
            yield from each(field, sample.field, 0.15e-6)
            yield self.truth.temperature_c, sample.temperature_c, 1 / 333.87

    def warnings(self) -> list[str]:
        return [*self.double.warnings, *self.magnetometer.warnings, *self.driver.warnings]


class Ak8963Row(Row):
    name = "ak8963"
    address = 0x0C
    wrong_identity = (0x00, 0x49)

    def build(self) -> Sequence[Target]:
        self.truth: Vector = (20e-6, 0.0, -40e-6)
        self.double = Ak8963Double(self.clock, lambda _: self.truth, noise_seed=None)
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Ak8963(self.bus)
        return self.driver.bring_up()

    def use(self) -> None:
        self.clock.advance(10 * MILLISECOND)
        self.driver.read_field()

    def verify(self) -> None:
        self.driver.verify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for share in (-1.0, -0.5, -0.001, 0.0, 0.001, 0.3, 1.0):
            x, y, z = self.truth = (share * 2500e-6, -share * 1000e-6, 300e-6 + share * 1000e-6)
            for _ in range(2):  # the first was measured before the field changed
                self.clock.advance(10 * MILLISECOND)
                found = self.driver.read_field()
            yield from each((y, x, -z), found, 0.15e-6)  # the die sits turned in its package

    def warnings(self) -> list[str]:
        return list(self.double.warnings)
