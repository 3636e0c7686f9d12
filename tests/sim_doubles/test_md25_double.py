"""The MD25's double by bytes; every expected value is worked out by hand."""

import math
from struct import unpack

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MILLISECOND = 1_000_000
SECOND = 1_000_000_000
ADDRESS = 0x58
COUNT_RAD = math.tau / 360
SIGNED = b"\x0f\x01"


@pytest.fixture
def driver(clock: ManualClock) -> Md25Double:
    """A speed of one unit turns the motor by one encoder count a second."""
    return Md25Double(
        clock, full_speed_rad_s=127 * COUNT_RAD, battery_v=12.34, currents_a=(0.52, 2.8), version=3
    )


@pytest.fixture
def bus(clock: ManualClock, driver: Md25Double) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, [driver])


def units(driver: Md25Double) -> tuple[float, float]:
    """Return the speeds in units of the registers."""
    first, second = driver.speeds_rad_s
    return first / COUNT_RAD, second / COUNT_RAD


def encoders(bus: I2cBusDouble) -> tuple[int, ...]:
    return unpack(">2i", bus.write_read(ADDRESS, b"\x02", 8))


def talk(bus: I2cBusDouble, clock: ManualClock, span: int) -> None:
    """Let time pass with a look at the chip every second."""
    while span > 0:
        clock.advance(min(span, SECOND))
        bus.write_read(ADDRESS, b"\x0d", 1)
        span -= SECOND


def test_power_up_values(bus: I2cBusDouble) -> None:
    registers = bus.write_read(ADDRESS, b"\x00", 18)
    assert registers[:10] == b"\x80\x80" + bytes(8)
    assert registers[10:] == bytes([123, 5, 28, 3, 5, 0, 0, 0])


def test_battery_and_currents_are_what_the_world_says(
    bus: I2cBusDouble, driver: Md25Double
) -> None:
    driver.battery_v, driver.currents_a = 30.0, (-1.0, 0.04)
    assert bus.write_read(ADDRESS, b"\x0a", 3) == bytes([255, 0, 0])


@pytest.mark.parametrize(
    ("mode", "first", "second", "speeds"),
    [
        (0, 255, 0, (127, -128)),
        (0, 128, 129, (0, 1)),
        (1, 127, 0x80, (127, -128)),
        (1, 0, 0xFF, (0, -1)),
        (2, 178, 138, (40, 60)),  # 50 forward, turn 10
        (2, 78, 138, (-40, -60)),  # 50 backward, turn 10
        (3, 0, 20, (-20, 20)),
        (3, 100, 100, (-73, 127)),  # 0 and 200 asked for: the difference is kept
        (3, 0x9C, 100, (72, -128)),  # 0 and -200 asked for
        (3, 127, 0x80, (127, -128)),  # 255 and -1 asked for: the difference is out of reach
    ],
)
def test_modes_give_the_bytes_their_meaning(  # noqa: PLR0917 (fixtures and cases)
    bus: I2cBusDouble,
    clock: ManualClock,
    driver: Md25Double,
    mode: int,
    first: int,
    second: int,
    speeds: tuple[int, int],
) -> None:
    bus.write(ADDRESS, bytes([15, mode]))
    bus.write(ADDRESS, bytes([0, first, second]))
    clock.advance(1900 * MILLISECOND)
    assert units(driver) == pytest.approx(speeds)
    assert bus.write_read(ADDRESS, b"\x00", 2) == bytes([first, second])
    assert driver.warnings == []


def test_speed_steps_by_the_acceleration_every_25_ms(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff\x78")  # 127 and -8
    steps = []
    for wait in (25 * MILLISECOND - 1, 1, 25 * MILLISECOND, 600 * MILLISECOND):
        clock.advance(wait)
        steps.append(units(driver))
    assert steps == [pytest.approx(pair) for pair in [(0, 0), (5, -5), (10, -8), (127, -8)]]


@pytest.mark.parametrize(("acceleration", "steps"), [(1, 255), (3, 85), (5, 51), (10, 26)])
def test_full_reverse_to_full_forward_takes_its_number_of_steps(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double, acceleration: int, steps: int
) -> None:
    bus.write(ADDRESS, bytes([14, acceleration]))
    bus.write(ADDRESS, b"\x00\x00")
    talk(bus, clock, 4 * SECOND)
    bus.write(ADDRESS, b"\x00\xff")
    talk(bus, clock, (steps - 1) * 25 * MILLISECOND)
    assert units(driver)[0] < 127
    clock.advance(25 * MILLISECOND)
    assert units(driver)[0] == pytest.approx(127)


def test_writing_the_same_speed_again_does_not_hold_the_ramp_up(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    for _ in range(100):
        bus.write(ADDRESS, b"\x00\xff")
        clock.advance(10 * MILLISECOND)
    assert units(driver)[0] == pytest.approx(127)


def test_a_new_acceleration_counts_for_a_ramp_under_way(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff")
    clock.advance(30 * MILLISECOND)
    bus.write(ADDRESS, b"\x0e\x0a")
    clock.advance(20 * MILLISECOND)
    assert units(driver)[0] == pytest.approx(15)


def test_turn_is_the_exact_integral_over_the_ramp(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff\x00")
    # 25 ms at each of 5, 10 to 125, then 127 from 650 ms on; backwards 128 instead
    clock.advance(SECOND)
    first, second = driver.turned_rad(clock())
    assert first / COUNT_RAD == pytest.approx(0.025 * 1625 + 0.35 * 127)
    assert second / COUNT_RAD == pytest.approx(-0.025 * 1625 - 0.35 * 128)


def test_encoders_count_degrees_of_the_output(bus: I2cBusDouble, clock: ManualClock) -> None:
    bus.write(ADDRESS, b"\x0e\x0a")
    bus.write(ADDRESS, b"\x00\xe4\x1c")  # 100 and -100
    clock.advance(1250 * MILLISECOND)  # 11.25 in ten steps, then 100 in a second
    assert encoders(bus) == (111, -112)


def test_encoders_reset_to_zero(bus: I2cBusDouble, clock: ManualClock) -> None:
    bus.write(ADDRESS, b"\x00\xff\x00")
    clock.advance(SECOND)
    bus.write(ADDRESS, b"\x10\x20")
    assert encoders(bus) == (0, 0)
    clock.advance(SECOND)
    first, second = encoders(bus)
    assert abs(first - 127) <= 1
    assert abs(second + 128) <= 1


def test_an_encoder_is_captured_when_its_first_byte_is_read(
    bus: I2cBusDouble, clock: ManualClock
) -> None:
    bus.write(ADDRESS, b"\x0e\x0a")
    bus.write(ADDRESS, b"\x00\xe4\xe4")
    clock.advance(1250 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x03", 3) == bytes(3)
    assert bus.write_read(ADDRESS, b"\x02", 1) == b"\x00"
    clock.advance(SECOND)
    assert bus.write_read(ADDRESS, b"\x03", 3) == b"\x00\x00\x6f"  # 111
    assert bus.write_read(ADDRESS, b"\x06", 4) == b"\x00\x00\x00\xd3"  # 211


def test_encoders_wrap_at_32_bits(clock: ManualClock) -> None:
    driver = Md25Double(clock, full_speed_rad_s=127 * 360e6 * COUNT_RAD)
    bus = I2cBusDouble("i2c-1", clock, [driver])
    bus.write(ADDRESS, b"\x10\x32")
    bus.write(ADDRESS, b"\x00\x81")
    clock.advance(6 * SECOND + 25 * MILLISECOND)
    assert abs(encoders(bus)[0] - (6 * 360_000_000 - (1 << 32))) <= 1


def test_two_seconds_of_silence_stop_the_motors(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff\xff")
    clock.advance(2 * SECOND - 1)
    assert units(driver) == pytest.approx((127, 127))
    clock.advance(1)
    assert units(driver) == (0, 0)
    turned = driver.turned_rad(clock())
    clock.advance(3600 * SECOND)
    assert driver.turned_rad(clock()) == turned
    assert turned[0] / COUNT_RAD == pytest.approx(0.025 * 1625 + 1.35 * 127)


def test_after_the_timeout_motors_wait_for_a_new_speed(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, SIGNED)
    bus.write(ADDRESS, b"\x00\x64\x64")
    clock.advance(2 * SECOND)
    assert bus.write_read(ADDRESS, b"\x00", 2) == b"\x00\x00"
    clock.advance(SECOND)
    assert units(driver) == (0, 0)
    bus.write(ADDRESS, b"\x00\x64\x64")
    clock.advance(SECOND)
    assert units(driver) == pytest.approx((100, 100))


def test_any_traffic_to_the_chip_puts_the_timeout_off(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff\xff")
    talk(bus, clock, 10 * SECOND)
    clock.advance(2 * SECOND - 1)
    assert units(driver) == pytest.approx((127, 127))
    clock.advance(1)
    assert units(driver) == (0, 0)


def test_traffic_to_other_chips_does_not(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x00\xff\xff")
    clock.advance(SECOND)
    with pytest.raises(NoAcknowledge):
        bus.write(0x59, b"\x00")
    clock.advance(SECOND)
    assert units(driver) == (0, 0)


def test_the_timeout_can_be_switched_off_and_on(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, b"\x10\x32")
    bus.write(ADDRESS, b"\x00\xff\xff")
    clock.advance(3600 * SECOND)
    assert units(driver) == pytest.approx((127, 127))
    bus.write(ADDRESS, b"\x10\x33")
    clock.advance(2 * SECOND)
    assert units(driver) == (0, 0)


def test_before_version_2_the_timeout_cannot_be_switched(clock: ManualClock) -> None:
    driver = Md25Double(clock, version=1)
    bus = I2cBusDouble("i2c-1", clock, [driver])
    bus.write(ADDRESS, b"\x10\x32")
    bus.write(ADDRESS, b"\x00\xff\xff")
    clock.advance(2 * SECOND)
    assert driver.speeds_rad_s == (0, 0)
    assert driver.warnings == ["MD25 0x58: command 0x32 does not exist; it is ignored"]


def test_a_new_mode_stops_the_motors_and_the_same_mode_does_not(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    bus.write(ADDRESS, SIGNED)
    bus.write(ADDRESS, b"\x00\x64\x9c")
    clock.advance(SECOND)
    bus.write(ADDRESS, SIGNED)
    assert units(driver) == pytest.approx((100, -100))
    bus.write(ADDRESS, b"\x0f\x02")
    assert units(driver) == (0, 0)
    assert bus.write_read(ADDRESS, b"\x00", 2) == b"\x80\x80"
    clock.advance(SECOND)
    assert units(driver) == (0, 0)


@pytest.mark.parametrize(
    ("write", "warning"),
    [
        (b"\x0f\x04", "register 15 written 4"),
        (b"\x0e\x00", "register 14 written 0"),
        (b"\x0e\x0b", "register 14 written 11"),
        (b"\x02\x00", "register 2 written 0"),
        (b"\x0d\x09", "register 13 written 9"),
        (b"\x11\x01", "register 17 written 1"),
    ],
)
def test_what_cannot_be_written_is_ignored_with_a_warning(
    bus: I2cBusDouble, driver: Md25Double, write: bytes, warning: str
) -> None:
    bus.write(ADDRESS, write)
    assert driver.warnings == [f"MD25 0x58: {warning}; the write is ignored"]
    assert bus.write_read(ADDRESS, b"\x0d", 4) == b"\x03\x05\x00\x00"


def test_regulation_is_switched_by_commands(bus: I2cBusDouble, driver: Md25Double) -> None:
    assert driver.regulated
    bus.write(ADDRESS, b"\x10\x30")
    assert not driver.regulated
    bus.write(ADDRESS, b"\x10\x31")
    assert driver.regulated


def test_address_changes_by_its_sequence_and_stays_over_a_power_cycle(
    bus: I2cBusDouble, driver: Md25Double
) -> None:
    for byte in (0xA0, 0xAA, 0xA5, 0xB4):
        bus.write(ADDRESS, bytes([16, byte]))
    bus.power_cycle()
    assert bus.write_read(0x5A, b"\x0d", 1) == b"\x03"
    with pytest.raises(NoAcknowledge):
        bus.write_read(ADDRESS, b"\x0d", 1)
    assert driver.warnings == []


def test_a_speed_in_between_breaks_the_address_sequence_off(
    bus: I2cBusDouble, driver: Md25Double
) -> None:
    for write in (b"\x10\xa0", b"\x10\xaa", b"\x00\x80", b"\x10\xa5", b"\x10\xb4"):
        bus.write(ADDRESS, write)
    assert driver.address == ADDRESS
    assert driver.warnings[0] == "MD25 0x58: command sequence broken off after 2 bytes"


def test_a_power_cycle_stops_the_motors_and_forgets_settings(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    for write in (SIGNED, b"\x0e\x0a", b"\x10\x32", b"\x00\x64\x64"):
        bus.write(ADDRESS, write)
    clock.advance(10 * SECOND)
    turned = driver.turned_rad(clock())
    bus.power_cycle()
    assert units(driver) == (0, 0)
    assert encoders(bus) == (0, 0)
    assert bus.write_read(ADDRESS, b"\x0e", 2) == b"\x05\x00"
    assert driver.turned_rad(clock()) == turned
    bus.write(ADDRESS, b"\x00\xff")
    clock.advance(2 * SECOND)
    assert units(driver) == (0, 0)


def test_the_world_advances_before_the_timeout_or_a_command_changes_its_course(
    bus: I2cBusDouble, clock: ManualClock, driver: Md25Double
) -> None:
    speeds: list[float] = []

    def advance_world() -> None:
        stretches = list(driver.motors.stretches(0, clock()))
        speeds.append(sum(s.speeds_rad_s[0] * (s.until - s.since) for s in stretches))

    driver.motors.before_change = advance_world
    bus.write(ADDRESS, b"\x00\xff")
    clock.advance(5 * SECOND)
    bus.write_read(ADDRESS, b"\x0d", 1)
    assert speeds == [0, pytest.approx((0.025 * 1625 + 1.35 * 127) * COUNT_RAD * 1e9)]


def test_an_address_outside_the_eight_is_refused(clock: ManualClock) -> None:
    with pytest.raises(ValueError, match="MD25: address is 0x60, expected 0x58 to 0x5f"):
        Md25Double(clock, 0x60)
