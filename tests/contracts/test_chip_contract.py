"""What holds of every chip: its driver against its double, each written from the data sheet alone.

One row a chip. A row knows how to wire the two, what the chip is used for and how to sweep its
range; the contract is the same for all.
"""

import importlib
import inspect
from pathlib import Path

import pytest

import drivers.chips
import sim_doubles.chips
from drivers.catalogue.table import chips, identities
from drivers.chips.ads1115 import Ads1115
from drivers.chips.cmps12 import Cmps12
from drivers.chips.md25 import Md25
from drivers.chips.mpu9250 import Mpu9250
from drivers.chips.pca9685 import Pca9685
from drivers.chips.sabertooth import Sabertooth
from drivers.chips.srf08 import Srf08
from firmware_runtime.hal.budget import bits
from firmware_runtime.hal.errors import BusTimeout, NoAcknowledge, NotReady, WrongDevice
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.faults import ForcedRegister, NackAddress, StuckSda
from tests.support.analog_rows import Ads1115Row
from tests.support.chip_row import MILLISECOND, Row
from tests.support.detective_rows import Cmps12Row, Hmc5883lRow, Md25Row, Srf08Row
from tests.support.tachobot_rows import Ak8963Row, Mpu9250Row, Pca9685Row

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
ON_SERIAL_LINES = {"sabertooth", "maxbotix"}
"""No bus, no row: see tests/drivers/test_detective_serial_chips_on_doubles.py."""
ADAPTERS = ["bcm2835", "designware", "i2c-gpio", "i2c-tiny-usb"]

ROWS: list[type[Row]] = [
    Pca9685Row,
    Mpu9250Row,
    Ak8963Row,
    Srf08Row,
    Cmps12Row,
    Hmc5883lRow,
    Md25Row,
    Ads1115Row,
]
UNHARMED = [row for row in ROWS if row.keeps_nothing]
FORGETFUL = [row for row in ROWS if not row.keeps_nothing]
STATING_TRAFFIC = [row for row in ROWS if row.traffic]
every_chip = pytest.mark.parametrize("row_type", ROWS, ids=lambda row: row.module)


@pytest.mark.parametrize(
    ("driver", "double"),
    [
        (Pca9685, Pca9685Double),
        (Mpu9250, Mpu9250Double),
        (Srf08, Srf08Double),
        (Cmps12, Cmps12Double),
        (Ads1115, Ads1115Double),
        (Md25, Md25Double),
        (Sabertooth, SabertoothDouble),
    ],
)
def test_without_an_address_a_driver_speaks_to_a_chip_as_shipped(
    driver: type, double: type
) -> None:
    addresses = [inspect.signature(each).parameters["address"].default for each in (driver, double)]
    assert addresses[0] == addresses[1]


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
    assert row.bus.errors == 0


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


@pytest.mark.parametrize("row_type", FORGETFUL, ids=lambda row: row.module)
def test_a_chip_that_lost_power_is_told_until_it_is_brought_up_again(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    row.use()
    row.wire.power_cycle()
    row.clock.advance(100 * MILLISECOND)
    with pytest.raises(NotReady, match=rf"at 0x{row.address:02x} on i2c-1: .*{row.told_as}"):
        row.look_after_power_loss()
    row.bring_up()
    row.use()
    row.verify()


@pytest.mark.parametrize("row_type", UNHARMED, ids=lambda row: row.module)
def test_a_chip_with_nothing_to_lose_goes_on_as_set_after_a_power_loss(
    row_type: type[Row],
) -> None:
    row = row_type()
    row.bring_up()
    row.use()
    row.wire.power_cycle()
    row.clock.advance(100 * MILLISECOND)
    for true, found, epsilon in row.sweep():
        assert abs(found - true) <= epsilon, (true, found)
    assert row.warnings() == []


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


@pytest.mark.parametrize("row_type", STATING_TRAFFIC, ids=lambda row: row.module)
def test_the_traffic_stated_for_the_budget_is_what_one_use_costs(row_type: type[Row]) -> None:
    row = row_type()
    row.bring_up()
    before, transactions = row.wire.bits, row.wire.transactions
    row.use()
    assert row.wire.bits - before == sum(map(bits, row_type.traffic))
    assert row.wire.transactions - transactions == len(row_type.traffic)


def test_every_driver_has_a_double_and_a_row() -> None:
    chips = modules_of(drivers.chips.__path__[0]) - PARTS_OF_DRIVERS
    for chip in chips:
        double = importlib.import_module(f"sim_doubles.chips.{chip}")
        assert hasattr(double, f"{chip.capitalize()}Double"), f"{chip} has no double"
    assert chips == {row.module for row in ROWS} | ON_SERIAL_LINES
    assert chips <= modules_of(sim_doubles.chips.__path__[0])


def modules_of(folder: str) -> set[str]:
    return {path.stem for path in Path(folder).glob("*.py")}


def test_every_driver_can_be_tried_and_those_on_a_bus_be_recognised() -> None:
    modules = {
        path.stem for path in Path(drivers.chips.__path__[0]).glob("*.py")
    } - PARTS_OF_DRIVERS
    assert set(chips()) == modules | {"h_bridge"}
    recognised = {identity.chip.lower().replace("-", "") for identity in identities()}
    assert modules - ON_SERIAL_LINES <= recognised
