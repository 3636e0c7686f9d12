"""The driver against its double: the contract of all chips, and the fixture of this one."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pytest
from firmware_drivers.chips.step import Step
from smbus2 import SMBus
from underwater.plumb.double import PlumbDouble
from underwater.plumb.driver import CONVERSION_NS, PRESSURE, TEMPERATURE, TRAFFIC, Plumb, Sounding

from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.row import Row
from sim_doubles.i2c_target import Target


class PlumbRow(Row):
    name, address, wrong_identity = "plumb", 0x76, None
    traffic = TRAFFIC
    keeps_nothing = True  # a loss of power costs nothing that the driver had set

    def build(self) -> Sequence[Target]:
        self.water = (101_325.0, 15.0)
        self.double = PlumbDouble(self.clock, water=lambda _: self.water)
        return [self.double]

    def steps(self) -> Sequence[Step]:
        self.driver = Plumb(self.bus)
        return self.driver.bring_up()

    def use(self) -> None:
        self.sounding()

    def sounding(self) -> Sounding:
        counts = []
        for conversion in (PRESSURE, TEMPERATURE):
            self.driver.begin(conversion)
            self.clock.advance(CONVERSION_NS)
            counts.append(self.driver.read())
        return self.driver.sounding(*counts)

    def verify(self) -> None:
        self.driver.identify()

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        for pressure_pa in (90_000.0, 101_325.0, 500_000.0, 1_400_000.0):
            for water_c in (-2.0, 4.0, 30.0):
                self.water = pressure_pa, water_c
                found = self.sounding()
                yield pressure_pa, found.pressure_pa, 0.1
                yield water_c, found.water_c, 0.001

    def warnings(self) -> list[str]:
        return self.double.warnings


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_contract(check: Check) -> None:
    check(PlumbRow)


def test_another_program_reads_the_double(i2c_double: Callable[..., Any]) -> None:
    i2c_double("plumb", water=lambda _: (201_325.0, 4.0))
    with SMBus(1) as bus:
        assert bus.read_i2c_block_data(0x76, 0xA0, 2) == [6000 >> 8, 6000 & 0xFF]
