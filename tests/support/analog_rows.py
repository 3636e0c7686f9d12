"""The row of the analog-to-digital converter in the contract of all chips."""

from collections.abc import Iterator, Sequence

from firmware_drivers.chips import ads1115
from firmware_drivers.chips.ads1115 import Ads1115, Ads1115Settings
from firmware_drivers.chips.step import Step

from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.contract.row import Row
from sim_doubles.i2c_target import Target


class Ads1115Row(Row):
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

    def verify(self) -> None:
        self.driver.verify()

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

    def warnings(self) -> list[str]:
        return list(self.double.warnings)
