"""Contract of chips on I2C: a driver against its double, each written from the data sheet.

A check is a function of a row's class, and its name is its sentence. Each builds rows of its own,
so they can be called in any order.
"""

from collections.abc import Callable
from typing import Final, TypeAlias

from firmware_runtime.hal.budget import bits
from firmware_runtime.hal.wire_errors import BusTimeout, NoAcknowledge, NotReady, WrongDevice
from sim_doubles.contract.expectation import (
    expect_equal,
    expect_raised,
    expect_sound,
    expect_swept,
)
from sim_doubles.contract.row import MILLISECOND, Row
from sim_doubles.faults import ForcedRegister, NackAddress, StuckSda
from sim_doubles.i2c_target import ADAPTERS

Check: TypeAlias = Callable[[type[Row]], None]


def bring_up_and_use_work_on_every_adapter_without_a_warning(row_type: type[Row]) -> None:
    """No adapter's rules are broken, and the double has nothing to object to."""
    for adapter in ADAPTERS:
        row = row_type(adapter)
        row.bring_up()
        row.use()
        row.verify()
        expect_sound(row)


def values_come_through_driver_and_double_over_the_whole_range(row_type: type[Row]) -> None:
    """The row's sweep, each value within its epsilon."""
    row = row_type()
    row.bring_up()
    expect_swept(row)
    expect_sound(row)


def an_absent_chip_is_named_by_bus_and_address(row_type: type[Row]) -> None:
    """NoAcknowledge: where, what, expected."""
    for adapter in ADAPTERS:
        row = row_type(adapter, absent=True)
        expected = rf"at 0x{row.address:02x} on i2c-1: no answer[;,] expected "
        expect_raised(NoAcknowledge, expected, row.bring_up)


def another_chip_is_named_by_what_was_found_and_expected(row_type: type[Row]) -> None:
    """WrongDevice, where an identity can be checked."""
    row = row_type()
    if row.wrong_identity is None:
        return
    register, value = row.wrong_identity
    row.faults.add(ForcedRegister(address=row.address, register=register, value=value))
    expected = rf"at 0x{row.address:02x} on i2c-1: .*{value:02x}.*expected"
    expect_raised(WrongDevice, expected, row.bring_up)


def a_stuck_bus_is_noticed_at_once_and_use_goes_on_after_recovery(row_type: type[Row]) -> None:
    """A held bus is not retried."""
    row = row_type()
    row.bring_up()
    row.faults.add(StuckSda(address=row.address))
    attempts = row.wire.transactions
    expect_raised(BusTimeout, "", row.use)
    expect_equal("transactions on the stuck bus", row.wire.transactions - attempts, 1)
    row.wire.recover()
    row.use()
    row.verify()


def a_bus_stuck_from_the_start_ends_the_bring_up(row_type: type[Row]) -> None:
    """BusTimeout comes out of the first step."""
    row = row_type()
    row.faults.add(StuckSda())
    expect_raised(BusTimeout, "", row.bring_up)


def a_passing_refusal_is_retried_and_counted(row_type: type[Row]) -> None:
    """Two refusals are two errors and two retries, of this chip."""
    row = row_type()
    row.bring_up()
    row.faults.add(NackAddress(address=row.address, times=2))
    row.use()
    expect_equal("errors and retries", (row.bus.errors, row.bus.retries), (2, 2))
    expect_equal("retries of this chip", row.bus.by_address[row.address].retries, 2)


def a_loss_of_power_is_noticed_until_the_chip_is_brought_up_again(row_type: type[Row]) -> None:
    """NotReady; a chip that had nothing set goes on as it was."""
    row = row_type()
    row.bring_up()
    row.use()
    row.wire.power_cycle()
    row.clock.advance(100 * MILLISECOND)
    if row.keeps_nothing:
        expect_swept(row)
        expect_equal("protocol warnings", row.warnings(), [])
        return
    expected = rf"at 0x{row.address:02x} on i2c-1: .*{row.reported_as}"
    expect_raised(NotReady, expected, row.look_after_power_loss)
    row.bring_up()
    row.use()
    row.verify()


def bring_up_works_from_any_state_a_former_program_left(row_type: type[Row]) -> None:
    """Twice or three times in a row, with use between."""
    for times in (2, 3):
        row = row_type()
        for _ in range(times):
            row.bring_up()
            row.use()
        row.verify()
        expect_equal("protocol warnings", row.warnings(), [])


def bring_up_cut_short_anywhere_can_be_begun_again(row_type: type[Row]) -> None:
    """After any number of its steps."""
    for length in range(len(row_type().steps())):
        row = row_type()
        for step in row.steps()[:length]:
            step.action()
        row.clock.advance(100 * MILLISECOND)
        row.bring_up()
        row.use()
        row.verify()


def what_the_accounted_bus_counts_is_what_the_wire_saw(row_type: type[Row]) -> None:
    """Transactions, bytes and time."""
    row = row_type()
    row.bring_up()
    row.use()
    expect_equal("transactions", row.bus.transactions, row.wire.transactions)
    expect_equal("bytes", row.bus.bytes, row.wire.bytes)
    expect_equal("busy ns", row.bus.busy_ns, row.wire.bits * 2500)


def the_traffic_stated_for_the_budget_is_what_one_use_costs(row_type: type[Row]) -> None:
    """Skip chips whose driver states none."""
    row = row_type()
    if not row.traffic:
        return
    row.bring_up()
    before, transactions = row.wire.bits, row.wire.transactions
    row.use()
    expect_equal("bits", row.wire.bits - before, sum(map(bits, row.traffic)))
    expect_equal("transactions", row.wire.transactions - transactions, len(row.traffic))


CHECKS: Final[tuple[Check, ...]] = (
    bring_up_and_use_work_on_every_adapter_without_a_warning,
    values_come_through_driver_and_double_over_the_whole_range,
    an_absent_chip_is_named_by_bus_and_address,
    another_chip_is_named_by_what_was_found_and_expected,
    a_stuck_bus_is_noticed_at_once_and_use_goes_on_after_recovery,
    a_bus_stuck_from_the_start_ends_the_bring_up,
    a_passing_refusal_is_retried_and_counted,
    a_loss_of_power_is_noticed_until_the_chip_is_brought_up_again,
    bring_up_works_from_any_state_a_former_program_left,
    bring_up_cut_short_anywhere_can_be_begun_again,
    what_the_accounted_bus_counts_is_what_the_wire_saw,
    the_traffic_stated_for_the_budget_is_what_one_use_costs,
)
