"""What holds of every chip: its driver against its double, each written from the data sheet alone.

One row a chip. A row knows how to wire the two, what the chip is used for and how to sweep its
range; the contract, `sim_doubles.contract`, is the same for all, those of other packages too.
"""

import importlib
import inspect
from pathlib import Path

import firmware_drivers.chips
import pytest
from firmware_drivers.catalogue.table import chips, identities
from firmware_drivers.chips.ads1115 import Ads1115
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.sabertooth import Sabertooth
from firmware_drivers.chips.srf08 import Srf08

import sim_doubles.chips
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.row import Row
from tests.support.chip_rows import (
    Ads1115Row,
    Ak8963Row,
    Cmps12Row,
    Hmc5883lRow,
    Md25Row,
    Mpu9250Row,
    Pca9685Row,
    Srf08Row,
)

PARTS_OF_DRIVERS = {
    "__init__",
    "bearing",
    "h_bridge",
    "liveness",
    "register_chip",
    "step",
    "setting",
    "mounting",
    "mpu9250_burst",
    "pca9685_registers",
    "shared_bring_up",
    "i2c_chip",
    "mpu9250_settings",
}
OF_AN_EXAMPLE = {"brook", "plumb"}  # examples/underwater, where it is installed
ON_SERIAL_LINES = {"sabertooth", "maxbotix"}
"""No bus, no row: see tests/drivers/test_detective_serial_chips_on_doubles.py."""

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


@pytest.mark.parametrize("row_type", ROWS, ids=lambda row: row.name)
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_contract(check: Check, row_type: type[Row]) -> None:
    check(row_type)


def test_every_chip_of_ours_can_be_recognised() -> None:
    assert [row for row in ROWS if row.wrong_identity is None] == []


def test_every_driver_has_a_double_and_a_row() -> None:
    chips = modules_of(firmware_drivers.chips.__path__[0]) - PARTS_OF_DRIVERS
    for chip in chips:
        double = importlib.import_module(f"sim_doubles.chips.{chip}")
        assert hasattr(double, f"{chip.capitalize()}Double"), f"{chip} has no double"
    assert chips == {row.name for row in ROWS} | ON_SERIAL_LINES
    assert chips <= modules_of(sim_doubles.chips.__path__[0])


def modules_of(folder: str) -> set[str]:
    return {path.stem for path in Path(folder).glob("*.py")}


def test_every_driver_can_be_tried_and_those_on_a_bus_be_recognised() -> None:
    modules = {
        path.stem for path in Path(firmware_drivers.chips.__path__[0]).glob("*.py")
    } - PARTS_OF_DRIVERS
    assert set(chips()) - OF_AN_EXAMPLE == modules | {"h_bridge"}
    recognised = {identity.chip.lower().replace("-", "") for identity in identities()}
    assert modules - ON_SERIAL_LINES <= recognised
