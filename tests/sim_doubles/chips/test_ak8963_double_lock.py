"""AK8963 double: data ready, overrun, and the lock from reading data until reading ST2."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.magnetometer import Die

MILLISECOND = 1_000_000
CONVERSION = 7_200_000
POWER_DOWN, SINGLE, CONTINUOUS_100_HZ, SELF_TEST = 0x10, 0x11, 0x16, 0x18


@pytest.fixture
def die(clock: ManualClock) -> Die:
    return Die(clock)


@pytest.mark.parametrize("register", range(0x03, 0x0A))
def test_any_data_register_clears_data_ready(die: Die, register: int) -> None:
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION)
    die.read(register)
    assert die.read(0x02) == b"\x00"


def test_reading_st1_leaves_data_ready(die: Die) -> None:
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION)
    assert die.read(0x02) == die.read(0x02) == b"\x01"


def test_sample_that_was_not_read_sets_overrun_until_data_is_read(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION)
    assert die.read(0x02) == b"\x01"
    die.clock.advance(10 * MILLISECOND)
    assert die.read(0x02, 8)[0] == 0x03
    assert die.read(0x02) == b"\x00"


def test_data_is_frozen_until_st2_is_read(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION)
    first = die.read(0x03, 6)
    die.field_t = (0.0, 0.0, 0.0)
    die.clock.advance(20 * MILLISECOND)
    assert die.read(0x02) == b"\x02"  # samples were lost, none is new
    assert die.read(0x03, 6) == first
    die.read(0x09)
    assert die.read(0x03, 6) == first
    die.read(0x09)
    die.clock.advance(10 * MILLISECOND)
    assert die.read(0x03, 6) == bytes(6)


def test_data_never_followed_by_st2_is_stale_forever(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION)
    first = die.read(0x03, 6)
    die.field_t = (0.0, 0.0, 0.0)
    for _ in range(20):
        die.clock.advance(10 * MILLISECOND)
        assert die.read(0x03, 6) == first
    assert len(die.asked) == 1


def test_single_measurements_are_fresh_though_st2_is_never_read(die: Die) -> None:
    """Linux' ak8975 reads six data bytes a single shot, and nothing else."""
    found = []
    for number in range(4):
        die.field_t = (0.0, number * 15e-6, 0.0)
        die.write(0x0A, SINGLE)
        die.clock.advance(CONVERSION)
        assert die.read(0x02) == b"\x01"
        found.append(die.read(0x03, 6))
    assert len(set(found)) == 4


def test_self_test_data_are_not_locked_either(die: Die) -> None:
    found = []
    for self_bit in (0x40, 0x00):
        die.write(0x0C, self_bit)
        die.write(0x0A, SELF_TEST)
        die.clock.advance(CONVERSION)
        found.append(die.read(0x03, 6))
    assert found[0] != found[1]


def test_a_single_measurement_after_a_locked_continuous_one_is_fresh(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION)
    locked = die.read(0x03, 6)
    die.field_t = (0.0, 0.0, 0.0)
    die.write(0x0A, POWER_DOWN)
    die.clock.advance(MILLISECOND)
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION)
    assert die.read(0x03, 6) == bytes(6) != locked


def test_continuous_mode_set_again_starts_a_new_measurement(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION - MILLISECOND)
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(CONVERSION - 1)
    assert die.read(0x02) == b"\x00"
    die.clock.advance(1)
    assert die.read(0x02) == b"\x01"
    assert die.asked == [2 * CONVERSION - MILLISECOND]
    assert die.chip.warnings == []


def test_a_single_measurement_under_way_goes_on_when_set_again(die: Die) -> None:
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION - MILLISECOND)
    die.write(0x0A, SINGLE)
    die.clock.advance(MILLISECOND)
    assert die.read(0x02) == b"\x01"


def test_sample_is_frozen_within_one_transaction(die: Die) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    assert die.chip.start(0x0C, read=False)
    die.chip.write(0x02)
    die.clock.advance(CONVERSION)
    assert die.chip.start(0x0C, read=True)
    assert die.chip.read() == 0x00
    die.chip.stop()
    assert die.read(0x02) == b"\x01"
