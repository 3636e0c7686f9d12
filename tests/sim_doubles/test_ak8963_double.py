"""AK8963 double, reached directly: registers, modes and their times, values, data ready, lock."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.magnetometer import NO_ADJUSTMENT, Die, Vector
from tests.support.wire import sentences

SINGLE, SINGLE_14_BIT = 0x11, 0x01


@pytest.fixture
def die(clock: ManualClock) -> Die:
    return Die(clock)


@sentences(
    {
        "identity and reset values": "W 00, R 48 9a 00*11",
        "a burst wraps from ASTC to WIA": "W 0b, R 00 00 48 9a",
        "a burst wraps within the sensitivity registers": "W 0a 1f; W 10, R b0 b1 a4 b0 b1",
        "sensitivity is valid in fuse ROM mode only": (
            "W 10, R 00*3; warns ASA read outside fuse ROM mode; "
            "warns ASA read outside fuse ROM mode; warns ASA read outside fuse ROM mode"
        ),
        "a read-only register keeps its value": "W 00 55; W 00, R 48; warns register 0x00 written",
        "the die answers its own address only": "0x0d R 00 -> refused",
        "a soft reset powers down and clears itself": (
            "W 0a 16; W 0b 01; W 0a, R 00 00; 50 ms; W 02, R 00"
        ),
        "I2CDIS silences the die until a power cycle": (
            "W 0f 1b; W 00, R 48 -> refused; power cycle; 100 us; W 00, R 48"
        ),
        "the die is deaf for 100 us after power-up": (
            "power cycle; 99.999 us; W 00, R 48 -> refused; 1 ns; W 00, R 48"
        ),
    }
)
def test_registers(die: Die, lines: str) -> None:
    die.play(lines)


@sentences(
    {
        "a single measurement lands after 7.2 ms and powers down": (
            "W 0a 11; 7199.999 us; W 02, R 00; 1 ns; W 02, R 01; W 0a, R 10; asked is [7_200_000]"
        ),
        "a single measurement stays the only one": (
            "W 0a 11; 7.2 ms; W 02, R 01 70 00 38 00 ea 00 10; 1 s; W 02, R 00; "
            "asked is [7_200_000]"
        ),
        # they land at 7.2 ms + n * 10 ms
        "a long silence costs one measurement": (
            "W 0a 16; 3600 s; W 02, R 03; asked is [3_599_997_200_000]"
        ),
        "a mode change without power-down is warned of": (
            "W 0a 16; W 0a 1f; warns from 6 to 15 without power-down"
        ),
        "a mode set within 100 us of power-down is warned of": (
            "W 0a 16; W 0a 10; 99.999 us; W 0a 1f; warns within 100 us"
        ),
        "a mode set 100 us after power-down is not warned of": "W 0a 16; W 0a 10; 100 us; W 0a 1f",
        "writing the running mode again disturbs nothing": (
            "W 0a 11; 3.6 ms; W 0a 11; 3.6 ms; W 02, R 01"
        ),
        "a mode that does not exist measures nothing": "W 0a 15; 1 s; W 02, R 00; warns mode 5",
        "a self-test asks no world": "W 0c 40; W 0a 18; 7.2 ms; W 02, R 01; asked is []",
    }
)
def test_modes_and_their_times(die: Die, lines: str) -> None:
    die.play(lines)


@pytest.mark.parametrize(("mode", "period"), [(0x16, 10_000_000), (0x12, 125_000_000)])
def test_continuous_mode_lands_every_period(die: Die, mode: int, period: int) -> None:
    die.play(f"W 0a {mode:02x}", "7.2 ms")
    for _ in range(3):
        assert die.read(0x02, 8)[0] == 0x01
        die.play("W 02, R 00", f"{period - 1} ns", "W 02, R 00", "1 ns")
    assert die.asked == [7_200_000 + n * period for n in range(3)]


# Values


def measure(die: Die, mode: int) -> tuple[list[int], int]:
    """One measurement: the little-endian words, and ST2."""
    die.play("W 0a 10", "100 us", f"W 0a {mode:02x}", "7.2 ms")
    data = die.read(0x02, 8)
    found = [int.from_bytes(data[i : i + 2], "little", signed=True) for i in (1, 3, 5)]
    return found, data[7]


@pytest.mark.parametrize(
    ("mode", "field_t", "words", "st2"),
    [  # X along the MPU's Y, Y along its X, Z against its Z; 0.15 uT a count
        pytest.param(SINGLE, (10e-6, 20e-6, -40e-6), [133, 67, 267], 0x10, id="axes of the die"),
        pytest.param(
            SINGLE_14_BIT, (10e-6, 20e-6, -40e-6), [33, 17, 67], 0x00, id="14 bits are coarser"
        ),
        pytest.param(SINGLE, (0, 6e-3, 6e-3), [32760, 0, -32760], 0x18, id="saturated"),
        pytest.param(SINGLE, (0, 6e-3, 0), [32760, 0, 0], 0x18, id="saturated on one axis"),
        pytest.param(
            SINGLE,
            (1637.3e-6, -1637.3e-6, 1637.3e-6),
            [-10915, 10915, -10915],
            0x10,
            id="a sum below 4912 uT is no overflow",
        ),
        pytest.param(
            SINGLE,
            (1637.4e-6, -1637.4e-6, 1637.4e-6),
            [-10916, 10916, -10916],
            0x18,
            id="a sum above is flagged",
        ),
    ],
)
def test_words_and_st2_follow_the_field(
    clock: ManualClock, mode: int, field_t: Vector, words: list[int], st2: int
) -> None:
    die = Die(clock, NO_ADJUSTMENT)
    die.field_t = field_t
    assert measure(die, mode) == (words, st2)


def test_sensitivity_lies_between_field_and_counts(die: Die) -> None:
    die.field_t = (150e-6, 150e-6, -150e-6)
    assert measure(die, SINGLE)[0] == [842, 839, 877]  # 1000 counts * 256 / (ASA + 128)


def test_overflow_flag_is_cleared_by_the_next_measurement(die: Die) -> None:
    flags = []
    for x_t in (4912e-6, 10e-6):
        die.field_t = (x_t, 0.0, 0.0)
        flags.append(measure(die, SINGLE)[1])
    assert flags == [0x18, 0x10]


def test_self_test_shows_the_coil_and_not_the_world(clock: ManualClock) -> None:
    die = Die(clock, NO_ADJUSTMENT)
    die.write(0x0C, 0x40)
    (x, y, z), _ = measure(die, 0x18)
    assert -200 <= x <= 200
    assert -200 <= y <= 200
    assert -3200 <= z <= -800


ONCE = "W 0a 11; 7.2 ms"
CONTINUOUS = "W 0a 16; 7.2 ms"
DATA = "85 00 43 00 0b 01"  # 133, 67, 267


@pytest.fixture
def plain(clock: ManualClock) -> Die:
    return Die(clock, NO_ADJUSTMENT)


@pytest.mark.parametrize("register", range(0x03, 0x0A))
def test_any_data_register_clears_data_ready(plain: Die, register: int) -> None:
    plain.play(ONCE)
    plain.read(register)
    plain.play("W 02, R 00")


@sentences(
    {
        "reading ST1 leaves data ready": f"{ONCE}; W 02, R 01; W 02, R 01",
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
def test_data_ready(plain: Die, lines: str) -> None:
    plain.play(lines)


def test_data_is_frozen_until_st2_is_read(plain: Die) -> None:
    plain.play(CONTINUOUS, f"W 03, R {DATA}")
    plain.field_t = (0.0, 0.0, 0.0)
    plain.play("20 ms", "W 02, R 02", f"W 03, R {DATA}")  # samples were lost, none is new
    plain.read(0x09)
    plain.play(f"W 03, R {DATA}")
    plain.read(0x09)
    plain.play("10 ms", "W 03, R 00*6")


def test_data_never_followed_by_st2_is_stale_forever(plain: Die) -> None:
    plain.play(CONTINUOUS, f"W 03, R {DATA}")
    plain.field_t = (0.0, 0.0, 0.0)
    for _ in range(20):
        plain.play("10 ms", f"W 03, R {DATA}")
    assert len(plain.asked) == 1


def test_single_measurements_are_fresh_though_st2_is_never_read(plain: Die) -> None:
    """Linux' ak8975 reads six data bytes a single shot, and nothing else."""
    found = set()
    for number in range(4):
        plain.field_t = (0.0, number * 15e-6, 0.0)
        plain.play("100 us", ONCE, "W 02, R 01")
        found.add(plain.read(0x03, 6))
    assert len(found) == 4


def test_self_test_data_are_not_locked_either(plain: Die) -> None:
    found = set()
    for self_bit in ("40", "00"):
        plain.play("100 us", f"W 0c {self_bit}", "W 0a 18", "7.2 ms")
        found.add(plain.read(0x03, 6))
    assert len(found) == 2


def test_a_single_measurement_after_a_locked_continuous_one_is_fresh(plain: Die) -> None:
    plain.play(CONTINUOUS, f"W 03, R {DATA}")
    plain.field_t = (0.0, 0.0, 0.0)
    plain.play("W 0a 10", "1 ms", ONCE, "W 03, R 00*6")


def test_sample_is_frozen_within_one_transaction(plain: Die) -> None:
    plain.write(0x0A, 0x16)
    assert plain.chip.start(0x0C, read=False)
    plain.chip.write(0x02)
    plain.clock.advance(7_200_000)
    assert plain.chip.start(0x0C, read=True)
    assert plain.chip.read() == 0x00
    plain.chip.stop()
    plain.play("W 02, R 01")
