"""Chips of register tables keep the contract, and a wrong one breaks it."""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import pytest
from firmware_drivers.chips.register_chip import ChipRegister, RegisterChip
from firmware_drivers.chips.step import Step, duration_ns

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice
from sim_doubles.chips.register_table_double import RegisterTableDouble, World
from sim_doubles.chips.register_target import ByteOrder, RegisterTarget
from sim_doubles.clock import ManualClock, Now
from sim_doubles.contract import chip
from sim_doubles.contract import register_table as checks
from sim_doubles.contract.chip import CHECKS, Check
from sim_doubles.contract.expectation import expect_raised
from sim_doubles.contract.register_table import TABLE_CHECKS, TableCheck
from sim_doubles.contract.row import Row
from sim_doubles.contract.table_row import TableRow
from sim_doubles.faults import StuckSda
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.worlds.swinging import swinging
from tests.support.chip_rows import Ads1115Row, Srf08Row
from tests.support.table_chip import EIGHT_BITS, WORDS, driver_of, row_of, table_of

ADDRESS = 0x36
ONE_BYTE, READ_ONLY, LITTLE = 0x04, 0x06, 0x08


class Chip(RegisterTarget):
    """Words that count on, one of them of one byte; what is read changes with every reading."""

    def __init__(self) -> None:
        super().__init__(ManualClock(), ADDRESS)
        self.words = {0x00: 0x1234, 0x02: 0x5678, ONE_BYTE: 0x9A, LITTLE: 0x0102}
        self.reads = 0
        self.cut = 0

    def _after(self, register: int) -> int:
        return register + 2

    def _width(self, register: int) -> int:
        return 1 if register == ONE_BYTE else 2

    def _order(self, register: int) -> ByteOrder:
        return "little" if register == LITTLE else "big"

    def _writes_to(self, register: int) -> bool:
        return register != READ_ONLY

    def _cut_short(self, register: int) -> None:  # noqa: ARG002
        self.cut += 1

    def _read_register(self, register: int) -> int:
        self.reads += 1
        return self.words.get(register, 0)

    def _write_register(self, register: int, byte: int) -> None:
        self.words[register] = byte


def chip_and_bus() -> tuple[Chip, I2cBusDouble]:
    chip = Chip()
    return chip, I2cBusDouble("i2c-1", ManualClock(), [chip])


def test_words_come_high_byte_first_or_last_and_the_pointer_goes_on_after_each() -> None:
    chip, bus = chip_and_bus()
    assert bus.write_read(ADDRESS, b"\x00", 5) == b"\x12\x34\x56\x78\x9a"
    assert chip.reads == 3
    chip, bus = chip_and_bus()
    assert bus.write_read(ADDRESS, bytes((LITTLE,)), 2) == b"\x02\x01"
    bus.write(ADDRESS, bytes((LITTLE, 0xCD, 0xAB)))
    assert chip.words[LITTLE] == 0xABCD


def test_a_word_is_taken_with_its_last_byte_and_a_rest_dropped_with_the_next_start() -> None:
    chip, bus = chip_and_bus()
    bus.write(ADDRESS, b"\x00\xab\xcd\xef")
    assert (chip.words[0x00], chip.words[0x02], chip.cut) == (0xABCD, 0x5678, 1)
    _, bus = chip_and_bus()
    assert bus.write_read(ADDRESS, b"\x00", 1) == b"\x12"
    assert bus.read(ADDRESS, 2) == b"\x56\x78"
    _, bus = chip_and_bus()
    bus.write_read(ADDRESS, b"\x02", 1)
    bus.power_cycle()
    assert bus.read(ADDRESS, 2) == b"\x12\x34"


def test_a_byte_that_is_refused_ends_the_transaction() -> None:
    chip, bus = chip_and_bus()
    with pytest.raises(NoAcknowledge):
        bus.write(ADDRESS, bytes((READ_ONLY, 1, 2)))
    assert READ_ONLY not in chip.words


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
    with pytest.raises((AssertionError, NoAcknowledge)):
        check(with_a_wrong_one(EIGHT_BITS, *WRONG[check]))


@pytest.mark.parametrize(("which", "said"), [("driver", "by the driver"), ("double", "")])
def test_the_other_order_of_bytes_breaks_it(which: str, said: str) -> None:
    row = with_a_wrong_one(WORDS, which, 'byte_order = "little"', 'byte_order = "big"')
    with pytest.raises(AssertionError, match=f"SWAPPED {said}"):
        checks.registers_read_as_the_table_says_after_power_up(row)


def with_a_wrong_one(text: str, which: str, that: str, this: str) -> type[TableRow]:
    assert that in text
    right, wrong = table_of(text), table_of(text.replace(that, this))
    driver = driver_of(wrong if which == "driver" else right)
    of_double = wrong if which == "double" else right

    class Row(TableRow):
        table = right

        def make_driver(self, bus: I2cBus, address: int) -> RegisterChip:
            return driver(bus, address)

        def make_double(self, now: Now, address: int, world: World) -> RegisterTableDouble:
            return RegisterTableDouble(now, of_double, address, world)

    return Row


def test_a_driver_that_is_off_by_a_count_breaks_it() -> None:
    other = EIGHT_BITS.replace("offset = -10", "offset = -9.5")
    with pytest.raises(AssertionError):
        chip.values_come_through_driver_and_double_over_the_whole_range(row_of(other))


def test_a_driver_that_reads_a_register_off_by_one_breaks_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read = RegisterChip.read_by_name
    monkeypatch.setattr(RegisterChip, "read_by_name", lambda chip, name: read(chip, name) + 1)
    with pytest.raises(AssertionError, match="came through as"):
        chip.values_come_through_driver_and_double_over_the_whole_range(row_of(WORDS))


def test_a_chip_keeps_nothing_where_a_bring_up_leaves_its_registers_as_they_were() -> None:
    as_it_was = EIGHT_BITS.replace("bring_up = 0x81", "bring_up = 0x90")
    keeps_nothing = [row_of(each).keeps_nothing for each in (EIGHT_BITS, as_it_was, WORDS)]
    assert keeps_nothing == [False, True, True]


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


def test_a_quantity_is_the_worlds_at_its_first_byte_and_a_word_cut_short_is_not_taken() -> None:
    double, bus = wired(EIGHT_BITS)
    assert bus.write_read(0x29, b"\x04", 2) == b"\x00\x00"  # -10 N, the middle of the scale
    assert double.table.registers[3].word(1e9) == 0x7FFF
    assert double.table.registers[3].word(-1e9) == 0x8000
    double, bus = wired(WORDS)
    bus.write(0x40, b"\x00\x12")
    assert double.word("CONFIG") == 0x399F
    assert len(double.warnings) == 1


def test_a_quantity_swings_slowly_through_half_of_its_scale() -> None:
    world = swinging(table_of(EIGHT_BITS))
    assert callable(world)
    quarter_n = 0.5 * 0xFFFF / 4
    swung = [world(tenths * SECOND // 10)["force_n"] + 10.0 for tenths in range(101)]
    assert swung[::25] == pytest.approx([0.0, quarter_n, 0.0, -quarter_n, 0.0], abs=1.0)
    assert max(abs(later - sooner) for sooner, later in pairwise(swung)) < 0.07 * quarter_n


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


def test_without_an_identity_an_answer_is_enough_and_with_one_another_chip_is_recognised() -> None:
    _, bus = wired(WORDS)
    driver = driver_of(table_of(WORDS))(bus)
    assert driver.evidence() == "CONFIG reads 399f"
    assert duration_ns(driver.bring_up()) == 0, "it sets nothing"
    assert driver.read(ChipRegister("SWAPPED", 0x02, 2, "little")) == 0xABCD, "unsigned"
    with pytest.raises(NoAcknowledge, match="no answer; expected CONFIG"):
        driver_of(table_of(WORDS))(bus, 0x41).write_by_name("CONFIG", 1)
    double, bus = wired(EIGHT_BITS)
    double.put("ID", 0x33)
    with pytest.raises(WrongDevice, match="ID reads 33; expected 5a"):
        driver_of(table_of(EIGHT_BITS))(bus).identify()


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


class Unsettled(Ads1115Row):
    """Its settings are never as they should be."""

    def verify(self) -> None:
        raise NotReady("unsettled", where="at 0x4a on i2c-1", expected="settled")


class Objecting(Ads1115Row):
    """Its double has something to object to."""

    def warnings(self) -> list[str]:
        return ["noted"]


class ObjectingWithoutSettings(Srf08Row):
    """Likewise."""

    def warnings(self) -> list[str]:
        return ["noted"]


ON_EVERY_ADAPTER = chip.bring_up_and_use_work_on_every_adapter_without_a_warning
OVER_THE_RANGE = chip.values_come_through_driver_and_double_over_the_whole_range
POWER_LOST = chip.a_loss_of_power_is_noticed_until_the_chip_is_brought_up_again
FROM_ANY_STATE = chip.bring_up_works_from_any_state_a_former_program_left
STUCK = chip.a_stuck_bus_is_noticed_at_once_and_use_goes_on_after_recovery


@pytest.mark.parametrize(
    "check",
    [ON_EVERY_ADAPTER, STUCK, POWER_LOST, FROM_ANY_STATE, CUT_SHORT],
    ids=lambda check: check.__name__,
)
def test_settings_that_are_wrong_in_the_end_are_noticed(check: Check) -> None:
    with pytest.raises(NotReady):
        check(Unsettled)


@pytest.mark.parametrize(
    ("check", "row_type"),
    [
        (ON_EVERY_ADAPTER, Objecting),
        (OVER_THE_RANGE, Objecting),
        (FROM_ANY_STATE, Objecting),
        (POWER_LOST, ObjectingWithoutSettings),
    ],
    ids=lambda each: each.__name__,
)
def test_what_a_double_objects_to_is_noticed(check: Check, row_type: type[Row]) -> None:
    with pytest.raises(AssertionError, match="protocol warnings"):
        check(row_type)


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
