"""The driver against its double: the contract of all chips, and the table register by register."""

import pytest
from underwater.winch.double import TABLE, WinchDouble
from underwater.winch.driver import ADDRESSES, Winch

from firmware_runtime.hal.i2c import I2cBus
from sim_doubles.chips.register_table_double import World
from sim_doubles.clock import Now
from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.register_table import TABLE_CHECKS, TableCheck
from sim_doubles.contract.table_row import TableRow


class WinchRow(TableRow):
    """Driver and double of one test; what they must do is in the table."""

    table = TABLE

    def make_driver(self, bus: I2cBus, address: int) -> Winch:
        return Winch(bus, address)

    def make_double(self, now: Now, address: int, world: World) -> WinchDouble:
        return WinchDouble(now, address, world)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_contract_of_chips(check: Check) -> None:
    check(WinchRow)


@pytest.mark.parametrize("check", TABLE_CHECKS, ids=lambda check: check.__name__)
def test_register_table(check: TableCheck) -> None:
    check(WinchRow)


def test_driver_and_double_know_the_same_addresses() -> None:
    assert TABLE.addresses == ADDRESSES
