"""Chips made of register tables: they keep the contract, and a wrong one breaks it."""

import re

import pytest
from firmware_drivers.chips.register_chip import RegisterChip

from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge, WrongDevice
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.clock import ManualClock, Now
from sim_doubles.contract import register_table as checks
from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.register_table import TABLE_CHECKS, TableCheck
from sim_doubles.contract.table_row import TableRow
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.worlds.swinging import swinging
from tests.support.table_chip import EIGHT_BITS, WORDS, driver_of, row_of, table_of

every_table = pytest.mark.parametrize("text", [EIGHT_BITS, WORDS], ids=["8 bits", "16 bits"])


@every_table
@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_driver_and_double_of_a_table_keep_the_contract_of_chips(check: Check, text: str) -> None:
    check(row_of(text))


@every_table
@pytest.mark.parametrize("check", TABLE_CHECKS, ids=lambda check: check.__name__)
def test_driver_and_double_do_what_their_table_says(check: TableCheck, text: str) -> None:
    check(row_of(text))


# A wrong driver or double ------------------------------------------------------------------------

WRONG: dict[TableCheck, tuple[str, str, str]] = {
    checks.the_driver_has_the_registers_of_the_table: ("driver", '"STATUS"', '"STATE"'),
    checks.registers_read_as_the_table_says_after_power_up: (
        *("driver", "address = 0x02", "address = 0x09"),
    ),
    checks.a_loss_of_power_brings_that_back: ("double", "reset = 0x10", "reset = 0x11"),
    checks.read_only_registers_ignore_writes_and_the_double_warns: (
        *("double", '"r"\nreset = 0x5A\nidentity = true', '"rw"\nreset = 0x5A'),
    ),
    checks.write_only_registers_cannot_be_read: ("double", 'access = "w"', 'access = "rw"'),
    checks.bits_that_can_be_written_keep_what_the_driver_writes: (
        *("double", "writable = 0x81", "writable = 0x83"),
    ),
    checks.addresses_without_a_register_do_as_the_table_says: (
        *("double", 'reserved = "refused"', "reserved = 0"),
    ),
    checks.the_pointer_goes_on_or_stays_as_the_table_says: (
        *("double", "auto_increment = true", "auto_increment = false"),
    ),
    checks.reading_clears_the_bits_that_the_table_says: (
        *("double", "clear_on_read = 0x03", "clear_on_read = 0x01"),
    ),
    checks.bits_clear_by_themselves_after_the_time_in_the_table: (
        *("double", "busy_us = 500", "busy_us = 5000"),
    ),
}
"""Driver or double is made from a table with this instead of that."""


@pytest.mark.parametrize("check", TABLE_CHECKS, ids=lambda check: check.__name__)
def test_a_wrong_one_breaks_it(check: TableCheck) -> None:
    which, that, this = WRONG[check]
    assert that in EIGHT_BITS
    right, wrong = table_of(EIGHT_BITS), table_of(EIGHT_BITS.replace(that, this))
    driver = driver_of(wrong if which == "driver" else right)
    of_double = wrong if which == "double" else right

    class Row(TableRow):
        table = right

        def make_driver(self, bus: I2cBus, address: int) -> RegisterChip:
            return driver(bus, address)

        def make_double(self, now: Now, address: int, world: World) -> RegisterTableDouble:
            return RegisterTableDouble(now, of_double, address, world)

    with pytest.raises((AssertionError, NoAcknowledge)):
        check(Row)


# The double alone --------------------------------------------------------------------------------


def wired(text: str) -> tuple[RegisterTableDouble, I2cBusDouble]:
    table, clock = table_of(text), ManualClock()
    double = RegisterTableDouble(clock, table, table.addresses[0], swinging(table))
    return double, I2cBusDouble("i2c-1", clock, [double])


def test_the_second_byte_of_a_word_has_an_address_of_its_own_where_the_pointer_goes_on() -> None:
    text = EIGHT_BITS.replace('access = "r"\nreset = 0\n', 'access = "rw"\nreset = 0x1234\n')
    text = re.sub("(?m)^(quantity|unit|scale|offset|signed) = .*$", "", text)
    double, bus = wired(text)
    assert bus.write_read(0x29, b"\x04", 2) == b"\x34\x12"
    assert bus.write_read(0x29, b"\x05", 1) == b"\x12"
    bus.write(0x29, b"\x05\xab")
    assert double.word("DATA") == 0xAB34
    assert double.warnings == []


def test_a_quantity_is_the_worlds_at_its_first_byte_and_stops_at_the_ends_of_its_scale() -> None:
    double, bus = wired(EIGHT_BITS)
    assert bus.write_read(0x29, b"\x04", 2) == b"\x00\x00"  # -10 N, the middle of the scale
    assert double.table.registers[3].word(1e9) == 0x7FFF
    assert double.table.registers[3].word(-1e9) == 0x8000


def test_a_word_cut_short_is_not_taken() -> None:
    double, bus = wired(WORDS)
    bus.write(0x40, b"\x00\x12")
    assert double.word("CONFIG") == 0x399F
    assert len(double.warnings) == 1


def test_a_subclass_says_what_follows_from_a_write() -> None:
    seen = []

    class Double(RegisterTableDouble):
        def written(self, register: object, word: int) -> None:
            seen.append((getattr(register, "name", ""), word))

    table = table_of(EIGHT_BITS)
    bus = I2cBusDouble(
        "i2c-1", ManualClock(), [Double(ManualClock(), table, 0x29, swinging(table))]
    )
    bus.write(0x29, b"\x08\x42")
    assert seen == [("COMMAND", 0x42)]


def test_an_address_that_the_chip_cannot_have_is_refused() -> None:
    table = table_of(WORDS)
    with pytest.raises(ValueError, match="0x40, 0x41"):
        RegisterTableDouble(ManualClock(), table, 0x42, swinging(table))
    with pytest.raises(ValueError, match="0x40, 0x41"):
        driver_of(table)(I2cBusDouble("i2c-1", ManualClock(), []), 0x42)


def test_a_driver_without_an_identity_is_content_with_an_answer() -> None:
    _, bus = wired(WORDS)
    driver = driver_of(table_of(WORDS))(bus)
    assert driver.evidence() == "CONFIG reads 399f"
    with pytest.raises(NoAcknowledge, match="no answer; expected CONFIG"):
        driver_of(table_of(WORDS))(bus, 0x41).write_by_name("CONFIG", 1)


def test_another_chip_is_recognised_by_its_identity() -> None:
    double, bus = wired(EIGHT_BITS)
    double.put("ID", 0x33)
    with pytest.raises(WrongDevice, match="ID reads 33; expected 5a"):
        driver_of(table_of(EIGHT_BITS))(bus).identify()
