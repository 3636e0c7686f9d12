"""AK8963 double, reached directly: registers, modes and their times, values."""

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.clock import ManualClock
from tests.support.magnetometer import Die

MILLISECOND = 1_000_000
CONVERSION = 7_200_000
NO_ADJUSTMENT = (128, 128, 128)
POWER_DOWN, SINGLE, CONTINUOUS_100_HZ, FUSE_ROM = 0x10, 0x11, 0x16, 0x1F


class Rig(Die):
    """A die without an adjustment unless stated."""

    def __init__(self, clock: ManualClock, asa: tuple[int, int, int] = NO_ADJUSTMENT) -> None:
        super().__init__(clock, asa)

    def change_mode(self, mode: int) -> None:
        """Go through power-down and wait, as the data sheet asks."""
        self.write(0x0A, POWER_DOWN)
        self.clock.advance(100_000)
        self.write(0x0A, mode)

    def measure(self) -> bytes:
        """Return ST1, the six data bytes and ST2 of one single measurement."""
        self.change_mode(SINGLE)
        self.clock.advance(CONVERSION)
        return self.read(0x02, 8)


@pytest.fixture
def die(clock: ManualClock) -> Rig:
    return Rig(clock)


def words(data: bytes) -> list[int]:
    """Return the three little-endian words of a burst that begins at ST1."""
    return [int.from_bytes(data[i : i + 2], "little", signed=True) for i in (1, 3, 5)]


# Registers


def test_identity_and_reset_values(die: Rig) -> None:
    assert die.read(0x00, 13) == b"\x48\x9a" + bytes(11)


def test_burst_wraps_from_astc_to_wia(die: Rig) -> None:
    assert die.read(0x0B, 4) == b"\x00\x00\x48\x9a"


def test_burst_wraps_within_the_sensitivity_registers(clock: ManualClock) -> None:
    die = Rig(clock, asa=(176, 177, 164))
    die.change_mode(FUSE_ROM)
    assert die.read(0x10, 5) == bytes([176, 177, 164, 176, 177])
    assert die.chip.warnings == []


def test_sensitivity_is_valid_in_fuse_rom_mode_only(clock: ManualClock) -> None:
    die = Rig(clock, asa=(176, 177, 164))
    assert die.read(0x10, 3) == bytes(3)
    assert "ASA read outside fuse ROM mode" in die.chip.warnings[0]


def test_read_only_register_keeps_its_value(die: Rig) -> None:
    die.write(0x00, 0x55)
    assert die.read(0x00) == b"\x48"
    assert "register 0x00 written" in die.chip.warnings[0]


def test_die_answers_its_own_address_only(die: Rig) -> None:
    with pytest.raises(NoAcknowledge):
        die.bus.read(0x0D, 1)


def test_soft_reset_powers_down_and_clears_itself(die: Rig) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.write(0x0B, 0x01)
    assert die.read(0x0A, 2) == b"\x00\x00"
    die.clock.advance(50 * MILLISECOND)
    assert die.read(0x02) == b"\x00"


def test_i2cdis_silences_the_die_until_a_power_cycle(die: Rig) -> None:
    die.write(0x0F, 0x1B)
    with pytest.raises(NoAcknowledge):
        die.read(0x00)
    die.chip.power_cycle()
    die.clock.advance(100_000)
    assert die.read(0x00) == b"\x48"


def test_die_is_deaf_for_100_us_after_power_up(die: Rig) -> None:
    die.chip.power_cycle()
    die.clock.advance(99_999)
    with pytest.raises(NoAcknowledge):
        die.read(0x00)
    die.clock.advance(1)
    assert die.read(0x00) == b"\x48"


# Modes and times


def test_single_measurement_lands_after_7_2_ms_and_powers_down(die: Rig) -> None:
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION - 1)
    assert die.read(0x02) == b"\x00"
    die.clock.advance(1)
    assert die.read(0x02) == b"\x01"
    assert die.read(0x0A) == b"\x10"
    assert die.asked == [CONVERSION]


def test_single_measurement_stays_the_only_one(die: Rig) -> None:
    die.measure()
    die.clock.advance(1000 * MILLISECOND)
    assert die.read(0x02) == b"\x00"
    assert len(die.asked) == 1


@pytest.mark.parametrize(("mode", "period"), [(0x16, 10 * MILLISECOND), (0x12, 125 * MILLISECOND)])
def test_continuous_mode_lands_every_period(die: Rig, mode: int, period: int) -> None:
    die.write(0x0A, mode)
    die.clock.advance(CONVERSION)
    for _ in range(3):
        assert die.read(0x02, 8)[0] == 0x01
        assert die.read(0x02) == b"\x00"
        die.clock.advance(period - 1)
        assert die.read(0x02) == b"\x00"
        die.clock.advance(1)
    assert die.asked == [CONVERSION + n * period for n in range(3)]


def test_long_silence_costs_one_measurement(die: Rig) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.clock.advance(3_600_000 * MILLISECOND)
    assert die.read(0x02) == b"\x03"
    # landings are at 7.2 ms + n * 10 ms: the last one up to 3600 s
    assert die.asked == [3_599_997_200_000]


def test_mode_change_without_power_down_is_warned_of(die: Rig) -> None:
    die.write(0x0A, CONTINUOUS_100_HZ)
    die.write(0x0A, FUSE_ROM)
    assert "from 6 to 15 without power-down" in die.chip.warnings[0]


def test_mode_set_within_100_us_of_power_down_is_warned_of(die: Rig) -> None:
    die.change_mode(CONTINUOUS_100_HZ)
    die.write(0x0A, POWER_DOWN)
    die.clock.advance(99_999)
    assert die.chip.warnings == []
    die.write(0x0A, FUSE_ROM)
    assert "within 100 us" in die.chip.warnings[0]


def test_writing_the_running_mode_again_disturbs_nothing(die: Rig) -> None:
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION // 2)
    die.write(0x0A, SINGLE)
    die.clock.advance(CONVERSION // 2)
    assert die.read(0x02) == b"\x01"
    assert die.chip.warnings == []


def test_mode_that_does_not_exist_measures_nothing(die: Rig) -> None:
    die.write(0x0A, 0x15)
    die.clock.advance(1000 * MILLISECOND)
    assert die.read(0x02) == b"\x00"
    assert "mode 5" in die.chip.warnings[0]


# Values


def test_axes_are_those_of_the_die(die: Rig) -> None:
    # X along the MPU's Y, Y along its X, Z against its Z; 0.15 uT a count
    assert words(die.measure()) == [133, 67, 267]


def test_14_bit_output_is_coarser_and_says_so(die: Rig) -> None:
    die.write(0x0A, 0x01)
    die.clock.advance(CONVERSION)
    data = die.read(0x02, 8)
    assert words(data) == [33, 17, 67]
    assert data[7] == 0x00


def test_16_bit_output_echoes_its_width_in_st2(die: Rig) -> None:
    assert die.measure()[7] == 0x10


def test_sensitivity_lies_between_field_and_counts(clock: ManualClock) -> None:
    die = Rig(clock, asa=(176, 177, 164))
    die.field_t = (150e-6, 150e-6, -150e-6)
    # 1000 counts * 256 / (ASA + 128)
    assert words(die.measure()) == [842, 839, 877]


def test_strong_field_saturates(die: Rig) -> None:
    die.field_t = (0.0, 6000e-6, 6000e-6)
    assert words(die.measure()) == [32760, 0, -32760]


@pytest.mark.parametrize(("field_t", "st2"), [(1637.3e-6, 0x10), (1637.4e-6, 0x18)])
def test_overflow_is_flagged_from_a_sum_of_4912_ut(die: Rig, field_t: float, st2: int) -> None:
    die.field_t = (field_t, -field_t, field_t)
    assert die.measure()[7] == st2


def test_overflow_flag_is_cleared_by_the_next_measurement(die: Rig) -> None:
    die.field_t = (4912e-6, 0.0, 0.0)
    assert die.measure()[7] == 0x18
    die.field_t = (10e-6, 0.0, 0.0)
    assert die.measure()[7] == 0x10


def test_self_test_shows_the_coil_and_not_the_world(die: Rig) -> None:
    die.write(0x0C, 0x40)
    die.write(0x0A, 0x18)
    die.clock.advance(CONVERSION)
    x, y, z = words(die.read(0x02, 8))
    assert -200 <= x <= 200
    assert -200 <= y <= 200
    assert -3200 <= z <= -800
    assert die.asked == []
