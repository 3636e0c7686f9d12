"""The rows of the detective robot's I2C chips in the contract of all chips."""

import math
from collections.abc import Iterator, Sequence

from firmware_drivers.chips import cmps12, hmc5883l, md25, srf08
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings
from firmware_drivers.chips.md25 import Md25, Md25Settings
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.chips.step import Step

from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.contract.row import MILLISECOND, Row, each
from sim_doubles.i2c_target import Target


class Srf08Row(Row):
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

    def verify(self) -> None:
        self.driver.identify()

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

    def warnings(self) -> list[str]:
        return list(self.double.warnings)


class Cmps12Row(Row):
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

    def verify(self) -> None:
        self.driver.identify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for twentieths in range(0, 360 * 20, 17):
            self.true_deg = twentieths / 20
            self.driver.identify()
            found = self.driver.read_bearing()
            yield 0.0, (found.bearing_deg - self.true_deg + 180) % 360 - 180, 0.05 + 1e-9
        for state in range(4):
            self.double.calibration_state = 0xFC | state
            yield state, self.driver.read_bearing().calibration or 0, 0

    def warnings(self) -> list[str]:
        return list(self.double.warnings)


class Hmc5883lRow(Row):
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

    def verify(self) -> None:
        self.driver.verify()

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

    def warnings(self) -> list[str]:
        return list(self.double.warnings)


class Md25Row(Row):
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

    def verify(self) -> None:
        self.driver.verify()

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

    def warnings(self) -> list[str]:
        return list(self.double.warnings)
