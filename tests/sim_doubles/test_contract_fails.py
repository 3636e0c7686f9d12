"""The contract is broken by a driver that is wrong: each check can fail."""

from collections.abc import Iterator, Sequence

import pytest
from firmware_drivers.chips.step import Step

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.contract import chip
from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.expectation import expect_raised
from sim_doubles.contract.row import Row
from sim_doubles.faults import StuckSda
from sim_doubles.i2c_target import Target
from tests.support.analog_rows import Ads1115Row


class WithoutADriver(Row):
    """Nothing is brought up, nothing is read, and every value is wrong."""

    name = "none"
    address = 0x48
    wrong_identity = (0, 1)
    traffic = ((b"\x00",),)

    def build(self) -> Sequence[Target]:
        return []

    def steps(self) -> Sequence[Step]:
        return ()

    def use(self) -> None:
        self.bus.errors += 1

    def verify(self) -> None:
        """Find nothing wrong."""

    def sweep(self) -> Iterator[tuple[float, float, float]]:
        yield 1.0, 2.0, 0.5

    def warnings(self) -> list[str]:
        return ["noted"]


CUT_SHORT = chip.bring_up_cut_short_anywhere_can_be_begun_again
"""It has nothing to cut short here."""
COUNTED = chip.what_the_accounted_bus_counts_is_what_the_wire_saw


@pytest.mark.parametrize(
    "check", [each for each in CHECKS if each not in {CUT_SHORT, COUNTED}], ids=lambda c: c.__name__
)
def test_a_driver_that_does_nothing_breaks_it(check: Check) -> None:
    with pytest.raises(AssertionError):
        check(WithoutADriver)


def test_a_transaction_past_the_accounted_bus_is_noticed() -> None:
    class Row(Ads1115Row):
        def use(self) -> None:
            self.wire.read(self.address, 1)

    with pytest.raises(AssertionError, match="transactions"):
        COUNTED(Row)


def test_a_bring_up_that_cannot_be_begun_again_is_noticed() -> None:
    class Row(Ads1115Row):
        brought_up = 0

        def steps(self) -> tuple[Step, ...]:
            self.brought_up += 1
            if self.brought_up == 2:
                self.faults.add(StuckSda())
            return super().steps()

    with pytest.raises(TimeoutError):
        CUT_SHORT(Row)


def test_another_text_than_expected_is_noticed() -> None:
    def refuse() -> None:
        raise NoAcknowledge("no")

    with pytest.raises(AssertionError, match="'no'"):
        expect_raised(NoAcknowledge, "at 0x48", refuse)
