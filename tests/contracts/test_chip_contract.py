"""What holds of every chip: its driver against its double, each written from the data sheet alone.

One row a chip. A row knows how to wire the two, what the chip is used for and how to sweep its
range; the contract is the same for all.
"""

import importlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import ClassVar, TypeAlias

import pytest

import drivers.chips
import sim_doubles.chips
from drivers.chips.ak8963 import Ak8963
from drivers.chips.mpu9250 import Mpu9250
from drivers.chips.pca9685 import Pca9685
from drivers.chips.step import Step
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.errors import BusTimeout, NoAcknowledge, NotReady, WrongDevice
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, ForcedRegister, NackAddress, StuckSda
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth

Vector: TypeAlias = tuple[float, float, float]

PARTS_OF_DRIVERS = {
    "__init__",
    "bearing",
    "h_bridge",
    "step",
    "setting",
    "mounting",
    "mpu9250_burst",
    "mpu9250_settings",
}
IN_THE_DETECTIVES_CONTRACT = {"srf08", "cmps12", "hmc5883l", "md25", "sabertooth", "maxbotix"}
"""Chips whose rows are in test_detective_chip_contract.py."""
ADAPTERS = ["bcm2835", "designware", "i2c-gpio", "i2c-tiny-usb"]
MILLISECOND = 1_000_000


class Row(ABC):
    """A chip's driver and double on one bus, with a clock that stands still."""

    module: ClassVar[str]
    address: ClassVar[int]
    wrong_identity: ClassVar[tuple[int, int]]
    """A register and what it reads on another chip."""

    def __init__(self, adapter: str = "bcm2835", *, absent: bool = False) -> None:
        self.clock = ManualClock()
        self.targets = [] if absent else self.build()
        self.faults = FaultScript()
        self.wire = I2cBusDouble(
            "i2c-1", self.clock, self.targets, adapter=adapter, faults=self.faults
        )
        self.bus = AccountedBus(self.wire, 400_000)

    @abstractmethod
    def build(self) -> Sequence[Target]:
        """Make the double, and what it needs beside it."""

    @abstractmethod
    def steps(self) -> tuple[Step, ...]:
        """Give the driver's bring-up."""

    @abstractmethod
    def use(self) -> None:
        """Do what the chip is for, once."""

    @abstractmethod
    def verify(self) -> None:
        """Have the driver check that the chip is as brought up."""

    @abstractmethod
    def sweep(self) -> Iterator[tuple[float, float, float]]:
        """Give true value, value through driver and double, and how far apart they may be."""

    @abstractmethod
    def warnings(self) -> list[str]:
        """List what the double objects to."""

    def bring_up(self) -> None:
        for step in self.steps():
            step.action()
            self.clock.advance(step.wait_ns)


class Pca9685Row(Row):
    module = "pca9685"
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
    module = "mpu9250"
    address = 0x69
    wrong_identity = (0x75, 0x68)

    def build(self) -> Sequence[Target]:
        self.truth = InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), (20e-6, 0, -40e-6), 25.0)
        self.magnetometer = Ak8963Double(self.clock, lambda _: self.truth.field)
        self.double = Mpu9250Double(
            self.clock, lambda _: self.truth, self.address, magnetometer=self.magnetometer
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
    module = "ak8963"
    address = 0x0C
    wrong_identity = (0x00, 0x49)

    def build(self) -> Sequence[Target]:
        self.truth: Vector = (20e-6, 0.0, -40e-6)
        self.double = Ak8963Double(self.clock, lambda _: self.truth)
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


def each(true: Vector, found: Vector, step: float) -> Iterator[tuple[float, float, float]]:
    """Compare by axis; rounding on both sides leaves one step at most."""
    for one, other in zip(true, found, strict=True):
        yield one, other, step


ROWS: list[type[Row]] = [Pca9685Row, Mpu9250Row, Ak8963Row]
every_chip = pytest.mark.parametrize("row_type", ROWS, ids=lambda row: row.module)


@every_chip
@pytest.mark.parametrize("adapter", ADAPTERS)
def test_bring_up_and_use_work_on_every_adapter_without_an_objection(
    row_type: type[Row], adapter: str
) -> None:
    row = row_type(adapter)
    row.bring_up()
    row.use()
    row.verify()
    assert row.warnings() == []
    assert row.bus.errors == 0


@every_chip
def test_values_come_through_driver_and_double_over_the_whole_range(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    for true, found, epsilon in row.sweep():
        assert abs(found - true) <= epsilon, (true, found)
    assert row.warnings() == []


@every_chip
@pytest.mark.parametrize("adapter", ADAPTERS)
def test_an_absent_chip_is_told_by_bus_address_and_name(row_type: type[Row], adapter: str) -> None:
    row = row_type(adapter, absent=True)
    expected = rf"at 0x{row.address:02x} on i2c-1: no answer, expected "
    with pytest.raises(NoAcknowledge, match=expected):
        row.bring_up()


@every_chip
def test_another_chip_is_told_by_what_was_found_and_expected(row_type: type[Row]) -> None:
    row = row_type()
    register, value = row.wrong_identity
    row.faults.add(ForcedRegister(address=row.address, register=register, value=value))
    expected = rf"at 0x{row.address:02x} on i2c-1: .*{value:02x}.*expected"
    with pytest.raises(WrongDevice, match=expected):
        row.bring_up()


@every_chip
def test_a_stuck_bus_is_told_at_once_and_use_goes_on_after_recovery(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    row.faults.add(StuckSda(address=row.address))
    attempts = row.wire.transactions
    with pytest.raises(BusTimeout):
        row.use()
    assert row.wire.transactions == attempts + 1
    row.wire.recover()
    row.use()
    row.verify()


@every_chip
def test_a_bus_stuck_from_the_start_ends_the_bring_up(row_type: type[Row]) -> None:
    row = row_type()
    row.faults.add(StuckSda())
    with pytest.raises(BusTimeout):
        row.bring_up()


@every_chip
def test_a_passing_refusal_is_retried_and_counted(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    row.faults.add(NackAddress(address=row.address, times=2))
    row.use()
    assert (row.bus.errors, row.bus.retries) == (2, 2)
    assert row.bus.by_address[row.address].retries == 2


@every_chip
def test_a_chip_that_lost_power_is_told_until_it_is_brought_up_again(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    row.use()
    row.wire.power_cycle()
    row.clock.advance(100 * MILLISECOND)
    with pytest.raises(NotReady, match=rf"at 0x{row.address:02x} on i2c-1: .*expected"):
        row.verify()
    row.bring_up()
    row.use()
    row.verify()


@every_chip
@pytest.mark.parametrize("times", [2, 3])
def test_bring_up_works_from_any_state_a_former_program_left(
    row_type: type[Row], times: int
) -> None:
    row = row_type()
    for _ in range(times):
        row.bring_up()
        row.use()
    row.verify()
    assert row.warnings() == []


@every_chip
def test_bring_up_cut_short_anywhere_can_be_begun_again(row_type: type[Row]) -> None:
    for length in range(len(row_type().steps())):
        row = row_type()
        for step in row.steps()[:length]:
            step.action()
        row.clock.advance(100 * MILLISECOND)
        row.bring_up()
        row.use()
        row.verify()


@every_chip
def test_what_the_accounted_bus_counts_is_what_the_wire_saw(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    row.use()
    assert row.bus.transactions == row.wire.transactions
    assert row.bus.bytes == row.wire.bytes
    assert row.bus.busy_ns == row.wire.bits * 2500


def test_every_driver_has_a_double_and_a_row() -> None:
    chips = modules_of(drivers.chips.__path__[0]) - PARTS_OF_DRIVERS
    for chip in chips:
        double = importlib.import_module(f"sim_doubles.chips.{chip}")
        assert hasattr(double, f"{chip.capitalize()}Double"), f"{chip} has no double"
    assert chips == {row.module for row in ROWS} | IN_THE_DETECTIVES_CONTRACT
    assert chips <= modules_of(sim_doubles.chips.__path__[0])


def modules_of(folder: str) -> set[str]:
    return {path.stem for path in Path(folder).glob("*.py")}
