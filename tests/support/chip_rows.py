"""Rows of the chip contract: each chip's driver and double on one bus."""

import math
from collections.abc import Iterator, Sequence
from typing import Generic, Protocol, TypeVar

from firmware_drivers.chips import ads1115, cmps12, hmc5883l, md25, srf08
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings
from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings
from firmware_drivers.chips.md25 import Md25, Md25Settings
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.chips.step import Step

from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.contract.row import MILLISECOND, Row, Vector, each
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth


class Identified(Protocol):
    """A driver as far as every row needs it."""

    def identify(self) -> object:
        """Check that the chip is what it should be."""


class Verified(Identified, Protocol):
    """A driver of a chip with settings."""

    def verify(self) -> None:
        """Check that it is as brought up."""


class Warned(Protocol):
    """A double as far as every row needs it."""

    @property
    def warnings(self) -> list[str]:
        """What it objects to."""


D = TypeVar("D", bound=Identified)
V = TypeVar("V", bound=Verified)
C = TypeVar("C", bound=Warned)


class OneChip(Row, Generic[D, C]):
    """A row with one driver and one double."""

    driver: D
    double: C

    def verify(self) -> None:
        self.driver.identify()

    def warnings(self) -> list[str]:
        return list(self.double.warnings)


class OneWithSettings(OneChip[V, C]):
    def verify(self) -> None:
        self.driver.verify()


class Pca9685Row(OneWithSettings[Pca9685, Pca9685Double]):
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

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for numerator in range(101):
            duty = numerator / 100
            for channel in (0, 7, 15):
                (written,) = self.driver.set_duties(channel, (duty,))
                yield duty, written, 0.5 / 4096
                yield written, self.double.duty(channel), 0.0


class Mpu9250Row(OneWithSettings[Mpu9250, Mpu9250Double]):
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


class Ak8963Row(OneWithSettings[Ak8963, Ak8963Double]):
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

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for share in (-1.0, -0.5, -0.001, 0.0, 0.001, 0.3, 1.0):
            x, y, z = self.truth = (share * 2500e-6, -share * 1000e-6, 300e-6 + share * 1000e-6)
            for _ in range(2):  # the first was measured before the field changed
                self.clock.advance(10 * MILLISECOND)
                found = self.driver.read_field()
            yield from each((y, x, -z), found, 0.15e-6)  # the die sits turned in its package


class Srf08Row(OneChip[Srf08, Srf08Double]):
    keeps_nothing = True
    name = "srf08"
    traffic = srf08.TRAFFIC
    address = 0x75
    wrong_identity = (0x00, 0xFF)

    def build(self) -> Sequence[Target]:
        self.distance = 1.0
        self.double = Srf08Double(self.clock, self.address, echoes=lambda _: [self.distance])
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Srf08(self.bus, self.address, Srf08Settings(max_range_m=6.0, gain=12))
        return self.driver.bring_up()

    def use(self) -> None:
        self.range()

    def range(self) -> float:
        self.driver.start_ranging()
        self.clock.advance(self.driver.ranging_ns)
        found = self.driver.read_distance()
        self.clock.advance(self.driver.interval_ns - self.driver.ranging_ns)
        return found

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for millimetres in range(50, 6000, 37):
            self.distance = millimetres / 1000
            yield self.distance, self.range(), 0.005 + 1e-9


class Cmps12Row(OneChip[Cmps12, Cmps12Double]):
    keeps_nothing = True
    name = "cmps12"
    traffic = cmps12.TRAFFIC
    address = 0x62
    wrong_identity = (0x02, 0xE2)

    def build(self) -> Sequence[Target]:
        self.true_deg = 200.0
        self.double = Cmps12Double(
            self.clock, self.address, bearing_deg=lambda _: self.true_deg, noise_seed=None
        )
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Cmps12(self.bus, self.address)
        return self.driver.bring_up()

    def use(self) -> None:
        self.driver.read_bearing()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for twentieths in range(0, 360 * 20, 17):
            self.true_deg = twentieths / 20
            self.driver.identify()
            found = self.driver.read_bearing()
            yield 0.0, (found.bearing_deg - self.true_deg + 180) % 360 - 180, 0.05 + 1e-9
        for state in range(4):
            self.double.calibration_state = 0xFC | state
            yield state, self.driver.read_bearing().calibration or 0, 0


class Hmc5883lRow(OneWithSettings[Hmc5883l, Hmc5883lDouble]):
    reported_as = "was reset"
    name = "hmc5883l"
    traffic = hmc5883l.TRAFFIC
    address = 0x1E
    wrong_identity = (0x0B, 0x35)

    def build(self) -> Sequence[Target]:
        self.truth = (20e-6, 0.0, -40e-6)
        self.double = Hmc5883lDouble(self.clock, lambda _: self.truth, noise_seed=None)
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Hmc5883l(self.bus, Hmc5883lSettings(range_gauss=2.5))
        return self.driver.bring_up()

    def use(self) -> None:
        self.measure()
        self.driver.read_bearing()

    def look_after_power_loss(self) -> None:
        self.use()

    def measure(self) -> None:
        for step in self.driver.measurement:
            step.action()
            self.clock.advance(step.wait_ns)

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for share in (-0.99, -0.5, -0.001, 0.0, 0.001, 0.3, 0.99):
            self.truth = (share * 250e-6, -share * 100e-6, 50e-6 - share * 100e-6)
            self.measure()
            yield from each(self.truth, self.driver.read_field(), 1e-4 / 660)
        for bearing_deg in range(0, 360, 7):
            angle = math.radians(bearing_deg)
            self.truth = (200e-6 * math.cos(angle), 200e-6 * math.sin(angle), -40e-6)
            self.measure()
            found = self.driver.read_bearing().bearing_deg
            yield 0.0, (found - bearing_deg + 180) % 360 - 180, 0.1


class Md25Row(OneWithSettings[Md25, Md25Double]):
    reported_as = "was reset"
    name = "md25"
    traffic = md25.TRAFFIC
    address = 0x5A
    wrong_identity = (0x0F, 0x7F)

    def build(self) -> Sequence[Target]:
        self.double = Md25Double(self.clock, self.address, full_speed_rad_s=10.0)
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        self.driver = Md25(self.bus, self.address, Md25Settings(acceleration=10))
        return self.driver.bring_up()

    def use(self) -> None:
        self.driver.set_speeds(0.5, -0.5)

    def look_after_power_loss(self) -> None:
        self.use()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for hundredths in range(-100, 101, 5):
            speed = hundredths / 100
            self.driver.set_speeds(speed, -speed)
            self.clock.advance(1000 * MILLISECOND)
            left, right = self.double.speeds_rad_s
            yield speed, left / 10.0, 0.5 / 127 + 1e-9
            yield -speed, right / 10.0, 0.5 / 127 + 1e-9
        self.double.battery_v, self.double.currents_a = 11.3, (0.4, 2.8)
        self.driver.set_speeds(1.0, -1.0)
        self.clock.advance(1500 * MILLISECOND)
        report = self.driver.set_speeds(1.0, -1.0)
        turns = [turned / math.tau for turned in self.double.turned_rad(self.clock())]
        yield turns[0] * 360, report.left_encoder, 1
        yield turns[1] * 360, report.right_encoder, 1
        yield 11.3, report.battery_v, 0.05
        yield 0.4, report.left_current_a, 0.05
        yield 2.8, report.right_current_a, 0.05


class Ads1115Row(OneWithSettings[Ads1115, Ads1115Double]):
    name = "ads1115"
    traffic = ads1115.TRAFFIC
    address = 0x4A
    wrong_identity = (0x01, 0x42)

    def build(self) -> Sequence[Target]:
        self.volts = [0.5, 1.0, 1.5, 2.0]
        self.double = Ads1115Double(self.clock, self.address, inputs=lambda _: self.volts)
        return [self.double]

    def steps(self) -> tuple[Step, ...]:
        settings = Ads1115Settings(full_scale_v=4.096, rate_sps=475)
        self.driver = Ads1115(self.bus, self.address, settings)
        return self.driver.bring_up()

    def use(self) -> None:
        self.voltage("AIN0-AIN3")

    def voltage(self, inputs: str) -> float:
        for step in self.driver.measurement(inputs):
            step.action()
            self.clock.advance(step.wait_ns)
        return self.driver.read_voltage()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        lsb = 4.096 / 0x8000
        for millivolts in range(0, 4040, 61):
            volts = millivolts / 1000
            self.volts = [volts, 4.0 - volts, volts / 2, 0.1]
            for index, true in enumerate(self.volts):
                yield true, self.voltage(f"AIN{index}"), lsb
            yield 2 * volts - 4.0, self.voltage("AIN0-AIN1"), lsb
            yield volts / 2 - 0.1, self.voltage("AIN2-AIN3"), lsb
