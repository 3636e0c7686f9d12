"""The SRF08's double by bytes; every expected value is worked out by hand."""

import math

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MILLISECOND = 1_000_000
BODY = 0x75
CENTIMETRES = b"\x00\x51"


class Surroundings:
    """What reflects, and when it was asked for."""

    def __init__(self) -> None:
        self.distances = [1.234, 2.5]
        self.asked_at: list[int] = []

    def __call__(self, at: int) -> list[float]:
        self.asked_at.append(at)
        return self.distances


@pytest.fixture
def surroundings() -> Surroundings:
    return Surroundings()


@pytest.fixture
def sonar(clock: ManualClock, surroundings: Surroundings) -> Srf08Double:
    return Srf08Double(clock, BODY, echoes=surroundings, light=77, revision=6)


@pytest.fixture
def bus(clock: ManualClock, sonar: Srf08Double) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, [sonar])


def ranged(bus: I2cBusDouble, clock: ManualClock, command: int) -> bytes:
    """Range once and read all 36 registers when it is over."""
    bus.write(BODY, bytes([0, command]))
    clock.advance(65 * MILLISECOND)
    return bus.write_read(BODY, b"\x00", 36)


@pytest.mark.parametrize(
    ("command", "first", "second"),
    [
        (0x50, b"\x00\x31", b"\x00\x62"),  # 48.58 and 98.43 inches
        (0x51, b"\x00\x7b", b"\x00\xfa"),  # 123.4 and 250 cm
        (0x52, b"\x1c\x06", b"\x38\xc7"),  # 7174.4 and 14534.9 us
    ],
)
def test_echoes_come_big_endian_in_the_unit_of_the_command(
    bus: I2cBusDouble, clock: ManualClock, command: int, first: bytes, second: bytes
) -> None:
    registers = ranged(bus, clock, command)
    assert registers == bytes([6, 77]) + first + second + bytes(30)


def test_echoes_are_read_once_at_the_instant_of_the_ping(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double, surroundings: Surroundings
) -> None:
    clock.advance(3)
    ranged(bus, clock, 0x51)
    assert surroundings.asked_at == [3]
    assert sonar.pings == 1


def test_no_echo_reads_zero(
    bus: I2cBusDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    ranged(bus, clock, 0x51)
    surroundings.distances = [math.inf]
    assert ranged(bus, clock, 0x51)[2:] == bytes(34)


def test_seventeen_echoes_are_kept(
    bus: I2cBusDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    surroundings.distances = [0.5 * n for n in range(1, 20)]
    registers = ranged(bus, clock, 0x51)
    assert registers[34:] == (850).to_bytes(2, "big")


def test_an_echo_nearer_than_three_centimetres_is_not_seen(
    bus: I2cBusDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    surroundings.distances = [0.004, 0.029, 0.031]
    assert ranged(bus, clock, 0x51)[2:6] == b"\x00\x03\x00\x00"


def test_range_register_cuts_what_is_farther(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double, surroundings: Surroundings
) -> None:
    surroundings.distances = [6.019, 6.021]  # (139 + 1) x 43 mm = 6.020 m
    bus.write(BODY, b"\x02\x8b")
    assert ranged(bus, clock, 0x51)[2:6] == b"\x02\x5a\x00\x00"
    assert sonar.farthest_m == pytest.approx(6.02)


@pytest.mark.parametrize(
    ("range_register", "busy_ms"), [(255, 64), (139, 35), (0, 0.25), (93, 23.5)]
)
def test_chip_is_silent_while_ranging_for_a_time_that_follows_the_range(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double, range_register: int, busy_ms: float
) -> None:
    bus.write(BODY, bytes([2, range_register]))
    bus.write(BODY, CENTIMETRES)
    clock.advance(round(busy_ms * MILLISECOND) - 1)
    assert sonar.ranging
    with pytest.raises(NoAcknowledge):
        bus.write_read(BODY, b"\x00", 1)
    clock.advance(1)
    assert not sonar.ranging
    assert bus.write_read(BODY, b"\x00", 1) == b"\x06"
    assert sonar.warnings == [
        "SRF08 0x75: written to while ranging; the real chip does not acknowledge"
    ]


def test_ranging_begins_at_stop_so_one_write_may_set_gain_and_range_too(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double
) -> None:
    bus.write(BODY, b"\x00\x51\x00\x17")
    assert [sonar.max_gain, sonar.farthest_m] == pytest.approx([94, 1.032])
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(BODY, b"\x02", 2) == b"\x00\x00"


def test_power_up_has_full_range_full_gain_and_no_echo(
    bus: I2cBusDouble, sonar: Srf08Double
) -> None:
    assert bus.write_read(BODY, b"\x00", 37) == bytes([6, *bytes(35), 0xFF])
    assert [sonar.max_gain, sonar.farthest_m] == pytest.approx([1025, 11.008])


@pytest.mark.parametrize(("register", "gain"), [(0, 94), (16, 177), (31, 1025)])
def test_gain_register_chooses_the_gain(
    bus: I2cBusDouble, sonar: Srf08Double, register: int, gain: int
) -> None:
    bus.write(BODY, bytes([1, register]))
    assert sonar.max_gain == gain
    assert sonar.warnings == []


def test_gain_above_31_is_warned_of(bus: I2cBusDouble, sonar: Srf08Double) -> None:
    bus.write(BODY, b"\x01\x20")
    assert sonar.max_gain == 1025
    assert sonar.warnings == ["SRF08 0x75: gain 32 written; 31 is the most there is"]


def test_pings_closer_than_65_ms_are_warned_of(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double
) -> None:
    for wait in (65 * MILLISECOND, 65 * MILLISECOND - 1000, 0):
        bus.write(BODY, CENTIMETRES)
        clock.advance(wait)
    (warning,) = sonar.warnings
    assert warning.startswith("SRF08 0x75: ranging 64.999 ms after the last; under 65 ms")


def test_general_call_ranges_every_sonar_on_the_bus(clock: ManualClock, sonar: Srf08Double) -> None:
    other = Srf08Double(clock, 0x73, echoes=lambda _: [3.0])
    bus = I2cBusDouble("i2c-1", clock, [sonar, other])
    bus.write(0x00, CENTIMETRES)
    assert sonar.ranging
    assert other.ranging
    clock.advance(64 * MILLISECOND)
    assert bus.write_read(0x73, b"\x02", 2) == b"\x01\x2c"
    assert bus.write_read(BODY, b"\x02", 2) == b"\x00\x7b"


def test_a_sonar_that_ranges_misses_a_general_call(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double
) -> None:
    bus.write(BODY, CENTIMETRES)
    clock.advance(63 * MILLISECOND)
    with pytest.raises(NoAcknowledge):
        bus.write(0x00, CENTIMETRES)
    assert sonar.pings == 1


def test_general_call_is_not_answered_for_reading(bus: I2cBusDouble) -> None:
    with pytest.raises(NoAcknowledge):
        bus.read(0x00, 1)


def test_software_reset_of_other_chips_does_nothing(bus: I2cBusDouble, sonar: Srf08Double) -> None:
    bus.write(0x00, b"\x06")
    assert not sonar.ranging
    assert sonar.warnings == []


def test_ann_mode_marks_the_slots_in_which_echoes_came(
    bus: I2cBusDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    surroundings.distances = [0.3, 3.0, 10.95]  # slots of 352 mm: 0, 8 and 31
    registers = ranged(bus, clock, 0x54)
    marked = [slot for slot in range(32) if registers[4 + slot]]
    assert registers[2:4] == b"\x00\x1e"
    assert marked == [0, 8, 31]


def test_ann_mode_without_an_echo_reads_zero(
    bus: I2cBusDouble, clock: ManualClock, surroundings: Surroundings
) -> None:
    surroundings.distances = []
    assert ranged(bus, clock, 0x55)[2:] == bytes(34)


def change_address(bus: I2cBusDouble, *commands: int) -> None:
    for command in commands:
        bus.write(BODY, bytes([0, command]))


def test_address_changes_by_its_sequence_and_stays_over_a_power_cycle(
    bus: I2cBusDouble, sonar: Srf08Double
) -> None:
    change_address(bus, 0xA0, 0xAA, 0xA5, 0xE6)
    bus.power_cycle()
    assert sonar.address == 0x73
    assert bus.write_read(0x73, b"\x00", 1) == b"\x06"
    with pytest.raises(NoAcknowledge):
        bus.write_read(BODY, b"\x00", 1)


def test_a_write_in_between_breaks_the_address_sequence_off(
    bus: I2cBusDouble, sonar: Srf08Double
) -> None:
    change_address(bus, 0xA0, 0xAA)
    bus.write(BODY, b"\x01\x05")
    change_address(bus, 0xA5, 0xE6)
    assert sonar.address == BODY
    assert sonar.warnings == [
        "SRF08 0x75: command sequence broken off after 2 bytes",
        "SRF08 0x75: command 0xa5 does not exist; it is ignored",
        "SRF08 0x75: command 0xe6 does not exist; it is ignored",
    ]


def test_a_sequence_in_one_write_is_no_sequence(bus: I2cBusDouble, sonar: Srf08Double) -> None:
    bus.write(BODY, b"\x00\xa0\xaa\xa5\xe6")
    assert sonar.address == BODY
    assert sonar.warnings == [
        "SRF08 0x75: command sequence broken off after 1 bytes",
        "SRF08 0x75: gain 170 written; 31 is the most there is",
        "SRF08 0x75: register 0x03 is read-only; the write is ignored",
    ]


def test_a_broken_sequence_may_start_over_at_once(bus: I2cBusDouble, sonar: Srf08Double) -> None:
    change_address(bus, 0xA0, 0xA0, 0xAA, 0xA5, 0xFE)
    assert sonar.address == 0x7F
    assert sonar.warnings.total == 1


@pytest.mark.parametrize("byte", [0xE7, 0xDE, 0x00])
def test_an_impossible_new_address_is_ignored(
    bus: I2cBusDouble, sonar: Srf08Double, byte: int
) -> None:
    change_address(bus, 0xA0, 0xAA, 0xA5, byte)
    assert sonar.address == BODY
    assert "is not an even number from 0xe0 to 0xfe" in sonar.warnings[0]


def test_a_power_cycle_ends_ranging_and_forgets_settings(
    bus: I2cBusDouble, clock: ManualClock, sonar: Srf08Double
) -> None:
    bus.write(BODY, b"\x01\x00\x10")
    ranged(bus, clock, 0x51)
    bus.write(BODY, CENTIMETRES)
    bus.power_cycle()
    assert bus.write_read(BODY, b"\x00", 4) == bytes([6, 0, 0, 0])
    assert [sonar.max_gain, sonar.farthest_m] == pytest.approx([1025, 11.008])


def test_echo_registers_are_read_only(bus: I2cBusDouble, sonar: Srf08Double) -> None:
    bus.write(BODY, b"\x03\x12")
    assert sonar.warnings == ["SRF08 0x75: register 0x03 is read-only; the write is ignored"]


def test_a_sonar_left_at_0x70_puts_a_pca9685_to_sleep_with_its_clock_gone(
    clock: ManualClock,
) -> None:
    pwm = Pca9685Double(clock, 0x40)
    bus = I2cBusDouble("i2c-1", clock, [pwm, Srf08Double(clock, echoes=lambda _: [])])
    bus.write(0x70, CENTIMETRES)
    assert bus.write_read(0x40, b"\x00", 1) == b"\x51"  # EXTCLK, SLEEP, ALLCALL
    bus.write(0x40, b"\x00\x01")
    assert bus.write_read(0x40, b"\x00", 1) == b"\x41"
    assert not pwm.running


def test_an_address_outside_the_sixteen_is_refused(clock: ManualClock) -> None:
    with pytest.raises(ValueError, match="SRF08: address is 0x60, expected 0x70 to 0x7f"):
        Srf08Double(clock, 0x60, echoes=lambda _: [])
