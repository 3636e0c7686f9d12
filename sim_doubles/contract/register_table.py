"""Contract of chips with a register table: driver and double do what the table says.

A check is a function of a row's class, and its name is its sentence, as in `contract.chip`.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Final, TypeAlias

from firmware_runtime.board.registers.register_table import Register
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.contract.expectation import expect, expect_equal, expect_raised
from sim_doubles.contract.table_row import TableRow

TableCheck: TypeAlias = Callable[[type[TableRow]], None]
RELEASED: Final = 0xFF


def the_driver_has_the_registers_of_the_table(row_type: type[TableRow]) -> None:
    """All of them, and no others."""
    found = sorted(row_type().driver.registers)
    expect_equal(
        "the driver's registers", found, sorted(each.name for each in row_type.table.registers)
    )


def registers_read_as_the_table_says_after_power_up(row_type: type[TableRow]) -> None:
    """By the driver, and byte by byte."""
    for each in row_type.table.readable:
        found = row_type().driver.read_by_name(each.name)
        expect_equal(f"{each.name} by the driver", found & each.all_bits, each.reset)
        raw = row_type().read_raw(each.address, each.bytes)
        expect_equal(f"{each.name} on the bus", raw, each.reset.to_bytes(each.bytes, each.order))


def a_loss_of_power_brings_that_back(row_type: type[TableRow]) -> None:
    """Whatever was written before."""
    row = row_type()
    for each in _writable(row):
        row.write_raw(each, each.reset ^ each.all_bits)
    row.wire.power_cycle()
    for each in row.table.registers:
        expect_equal(f"{each.name} after a loss of power", row.double.word(each.name), each.reset)


def read_only_registers_ignore_writes_and_the_double_warns(row_type: type[TableRow]) -> None:
    """Their content stays."""
    for each in row_type.table.registers:
        if each.access == "r":
            row = row_type()
            row.write_raw(each, each.reset ^ each.all_bits)
            expect_equal(each.name, row.double.word(each.name), each.reset)
            expect(bool(row.warnings()), f"{each.name} was written without a warning")


def write_only_registers_cannot_be_read(row_type: type[TableRow]) -> None:
    """They read as an address without a register does."""
    row = row_type()
    for each in row.table.registers:
        if each.access == "w":
            found = row.read_raw(each.address, each.bytes)
            expect_equal(each.name, found, bytes((_reserved(row),)) * each.bytes)


def bits_that_can_be_written_keep_what_the_driver_writes(row_type: type[TableRow]) -> None:
    """And the others stay as they were."""
    for each in _writable(row_type()):
        row = row_type()
        fixed = each.all_bits & ~(each.kept_bits | each.self_clearing)
        for pattern in (0xFFFF, 0x5555, 0xAAAA, 0x1234, 0x0000):
            row.driver.write_by_name(each.name, pattern & each.all_bits)
            found = row.double.word(each.name)
            expect_equal(
                f"{each.name}, kept bits", found & each.kept_bits, pattern & each.kept_bits
            )
            expect_equal(f"{each.name}, fixed bits", found & fixed, each.reset & fixed)


def addresses_without_a_register_do_as_the_table_says(row_type: type[TableRow]) -> None:
    """They are refused, or read as it says; a write changes nothing."""
    row = row_type()
    before = [row.double.word(each.name) for each in row.table.registers]
    for address in row.table.free:
        if row.table.reserved == "refused":
            expect_raised(NoAcknowledge, "", lambda at=address: row.read_raw(at, 1))  # type: ignore[misc]
        else:
            expect_equal(f"0x{address:02x}", row.read_raw(address, 1), bytes((_reserved(row),)))
            row.wire.write(row.address, bytes((address, 0x5A)))
    after = [row.double.word(each.name) for each in row.table.registers]
    expect_equal("the registers", after, before)


def the_pointer_goes_on_or_stays_as_the_table_says(row_type: type[TableRow]) -> None:
    """Two registers, or the same one twice, in one burst."""
    for each in row_type.table.readable:
        row = row_type()
        first = each.reset.to_bytes(each.bytes, each.order)
        second = _following(row, each)
        if second is not None and not each.clear_on_read:
            found = row.read_raw(each.address, len(first + second))
            expect_equal(f"a burst from {each.name}", found, first + second)


def reading_clears_the_bits_that_the_table_says(row_type: type[TableRow]) -> None:
    """The reading itself still has them."""
    for each in row_type.table.readable:
        if each.clear_on_read:
            row = row_type()
            row.double.put(each.name, each.reset | each.clear_on_read)
            found = [row.driver.read_by_name(each.name) & each.clear_on_read for _ in range(2)]
            expect_equal(f"{each.name}, read twice", found, [each.clear_on_read, 0])


def bits_clear_by_themselves_after_the_time_in_the_table(row_type: type[TableRow]) -> None:
    """And not before."""
    for each in _writable(row_type()):
        if each.self_clearing:
            row = row_type()
            row.driver.write_by_name(each.name, each.self_clearing)
            begun = row.double.word(each.name) & each.self_clearing
            expect_equal(f"{each.name}, at once", begun, each.self_clearing if each.busy_ns else 0)
            row.clock.advance(each.busy_ns + MILLISECOND)
            ended = row.double.word(each.name) & each.self_clearing
            expect_equal(f"{each.name}, after {each.busy_us:g} us", ended, 0)


TABLE_CHECKS: Final[tuple[TableCheck, ...]] = (
    the_driver_has_the_registers_of_the_table,
    registers_read_as_the_table_says_after_power_up,
    a_loss_of_power_brings_that_back,
    read_only_registers_ignore_writes_and_the_double_warns,
    write_only_registers_cannot_be_read,
    bits_that_can_be_written_keep_what_the_driver_writes,
    addresses_without_a_register_do_as_the_table_says,
    the_pointer_goes_on_or_stays_as_the_table_says,
    reading_clears_the_bits_that_the_table_says,
    bits_clear_by_themselves_after_the_time_in_the_table,
)


def _writable(row: TableRow) -> Sequence[Register]:
    return [each for each in row.table.registers if "w" in each.access]


def _reserved(row: TableRow) -> int:
    return RELEASED if row.table.reserved == "refused" else row.table.reserved


def _following(row: TableRow, register: Register) -> bytes | None:
    """Return the register that a burst reads after another; None where none is to rely on."""
    if not row.table.auto_increment:
        return register.reset.to_bytes(register.bytes, register.order)
    return next(_registers_at(row, register.address + register.bytes), None)


def _registers_at(row: TableRow, address: int) -> Iterator[bytes]:
    for each in row.table.readable:
        if each.address == address:
            yield each.reset.to_bytes(each.bytes, each.order)
