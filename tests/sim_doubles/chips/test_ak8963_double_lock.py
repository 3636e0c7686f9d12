"""AK8963 double: data ready, overrun, and the lock from reading data until reading ST2."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.magnetometer import NO_ADJUSTMENT, Die
from tests.support.wire import sentences

SINGLE = "W 0a 11; 7.2 ms"
CONTINUOUS = "W 0a 16; 7.2 ms"
DATA = "85 00 43 00 0b 01"  # 133, 67, 267


@pytest.fixture
def die(clock: ManualClock) -> Die:
    return Die(clock, NO_ADJUSTMENT)


@pytest.mark.parametrize("register", range(0x03, 0x0A))
def test_any_data_register_clears_data_ready(die: Die, register: int) -> None:
    die.play(SINGLE)
    die.read(register)
    die.play("W 02, R 00")


@sentences(
    {
        "reading ST1 leaves data ready": f"{SINGLE}; W 02, R 01; W 02, R 01",
        "a sample that was not read sets overrun until data is read": (
            f"{CONTINUOUS}; W 02, R 01; 10 ms; W 02, R 03 {DATA} 10; W 02, R 00"
        ),
        "continuous mode set again starts a new measurement": (
            "W 0a 16; 6.2 ms; W 0a 16; 7199.999 us; W 02, R 00; 1 ns; W 02, R 01; "
            "asked is [13_400_000]"
        ),
        "a single measurement under way goes on when set again": (
            "W 0a 11; 6.2 ms; W 0a 11; 1 ms; W 02, R 01"
        ),
    }
)
def test_data_ready(die: Die, lines: str) -> None:
    die.play(lines)


def test_data_is_frozen_until_st2_is_read(die: Die) -> None:
    die.play(CONTINUOUS, f"W 03, R {DATA}")
    die.field_t = (0.0, 0.0, 0.0)
    die.play("20 ms", "W 02, R 02", f"W 03, R {DATA}")  # samples were lost, none is new
    die.read(0x09)
    die.play(f"W 03, R {DATA}")
    die.read(0x09)
    die.play("10 ms", "W 03, R 00*6")


def test_data_never_followed_by_st2_is_stale_forever(die: Die) -> None:
    die.play(CONTINUOUS, f"W 03, R {DATA}")
    die.field_t = (0.0, 0.0, 0.0)
    for _ in range(20):
        die.play("10 ms", f"W 03, R {DATA}")
    assert len(die.asked) == 1


def test_single_measurements_are_fresh_though_st2_is_never_read(die: Die) -> None:
    """Linux' ak8975 reads six data bytes a single shot, and nothing else."""
    found = set()
    for number in range(4):
        die.field_t = (0.0, number * 15e-6, 0.0)
        die.play("100 us", SINGLE, "W 02, R 01")
        found.add(die.read(0x03, 6))
    assert len(found) == 4


def test_self_test_data_are_not_locked_either(die: Die) -> None:
    found = set()
    for self_bit in ("40", "00"):
        die.play("100 us", f"W 0c {self_bit}", "W 0a 18", "7.2 ms")
        found.add(die.read(0x03, 6))
    assert len(found) == 2


def test_a_single_measurement_after_a_locked_continuous_one_is_fresh(die: Die) -> None:
    die.play(CONTINUOUS, f"W 03, R {DATA}")
    die.field_t = (0.0, 0.0, 0.0)
    die.play("W 0a 10", "1 ms", SINGLE, "W 03, R 00*6")


def test_sample_is_frozen_within_one_transaction(die: Die) -> None:
    die.write(0x0A, 0x16)
    assert die.chip.start(0x0C, read=False)
    die.chip.write(0x02)
    die.clock.advance(7_200_000)
    assert die.chip.start(0x0C, read=True)
    assert die.chip.read() == 0x00
    die.chip.stop()
    die.play("W 02, R 01")
