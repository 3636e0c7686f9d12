"""The CMPS12's double by bytes; every expected value is worked out by hand."""

import math
import struct

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MILLISECOND = 1_000_000
ADDRESS = 0x61


class Attitude:
    """Where the compass points, and when that was asked for."""

    def __init__(self) -> None:
        self.bearing_deg = 123.42
        self.pitch_roll_deg = (-12.3, 45.6)
        self.asked_at: list[int] = []

    def bearing(self, at: int) -> float:
        self.asked_at.append(at)
        return self.bearing_deg

    def pitch_roll(self, _at: int) -> tuple[float, float]:
        return self.pitch_roll_deg


@pytest.fixture
def attitude() -> Attitude:
    return Attitude()


@pytest.fixture
def compass(clock: ManualClock, attitude: Attitude) -> Cmps12Double:
    return Cmps12Double(
        clock,
        ADDRESS,
        bearing_deg=attitude.bearing,
        pitch_roll_deg=attitude.pitch_roll,
        calibration_state=0x33,
        temperature_c=-4.0,
        version=7,
        noise_seed=None,
    )


@pytest.fixture
def bus(clock: ManualClock, compass: Cmps12Double) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, [compass])


def command(bus: I2cBusDouble, clock: ManualClock, *codes: int, wait_ms: int = 20) -> None:
    """Write commands one by one, with a wait after each."""
    for code in codes:
        bus.write(ADDRESS, bytes([0, code]))
        clock.advance(wait_ms * MILLISECOND)


def test_all_registers_at_one_attitude(bus: I2cBusDouble) -> None:
    registers = bus.write_read(ADDRESS, b"\x00", 32)
    assert registers[0] == 7
    assert registers[1] == 87  # 1234 / 3600 x 256 = 87.8
    assert registers[2:4] == b"\x04\xd2"  # 1234
    assert registers[4] == 0xF4  # -12
    assert registers[5] == 46
    assert registers[24] == 0
    assert registers[25] == 0xFC  # -4
    assert registers[26:28] == b"\x07\xb7"  # 1974.7 sixteenths
    assert registers[28:30] == b"\xff\xf4"  # -12
    assert registers[30] == 0x33
    assert registers[31] == 0xFF


def raw(bus: I2cBusDouble) -> tuple[int, ...]:
    """Magnetometer, accelerometer and gyro by axis."""
    return struct.unpack(">9h", bus.write_read(ADDRESS, b"\x06", 18))


@pytest.mark.parametrize(
    ("bearing_deg", "pitch_roll_deg", "field_and_force"),
    [
        (0.0, (0.0, 0.0), (320, 0, -640, 0, 0, 981)),
        (90.0, (0.0, 0.0), (0, 320, -640, 0, 0, 981)),
        (180.0, (0.0, 0.0), (-320, 0, -640, 0, 0, 981)),
        (0.0, (90.0, 0.0), (-640, 0, -320, 981, 0, 0)),
        (0.0, (0.0, 90.0), (320, -640, 0, 0, 981, 0)),
        (0.0, (30.0, 0.0), (-43, 0, -714, 490, 0, 849)),
    ],
)
def test_raw_sensors_follow_from_the_attitude(
    bus: I2cBusDouble,
    attitude: Attitude,
    bearing_deg: float,
    pitch_roll_deg: tuple[float, float],
    field_and_force: tuple[int, ...],
) -> None:
    attitude.bearing_deg, attitude.pitch_roll_deg = bearing_deg, pitch_roll_deg
    assert raw(bus) == (*field_and_force, 0, 0, 0)


def test_raw_gyro_is_in_sixteenths_of_a_degree_a_second(clock: ManualClock) -> None:
    turning = (0.0, math.radians(-10.0), math.radians(90.0))
    compass = Cmps12Double(
        clock, ADDRESS, bearing_deg=lambda _: 0.0, rate_rad_s=lambda _: turning, noise_seed=None
    )
    assert raw(I2cBusDouble("i2c-1", clock, [compass]))[6:] == (0, -160, 1440)


@pytest.mark.parametrize(
    ("bearing_deg", "tenths", "of_256"),
    [
        (0.0, 0, 0),
        (359.9, 3599, 255),
        (359.96, 0, 0),
        (-0.1, 3599, 255),
        (180.0, 1800, 128),
        (540.0, 1800, 128),
        (89.94, 899, 63),
    ],
)
def test_bearing_stays_below_a_full_circle(
    bus: I2cBusDouble, attitude: Attitude, bearing_deg: float, tenths: int, of_256: int
) -> None:
    attitude.bearing_deg = bearing_deg
    assert bus.write_read(ADDRESS, b"\x01", 3) == bytes([of_256, *tenths.to_bytes(2, "big")])


def test_pitch_and_roll_end_at_90_degrees(bus: I2cBusDouble, attitude: Attitude) -> None:
    attitude.pitch_roll_deg = (170.0, -95.0)
    assert bus.write_read(ADDRESS, b"\x04", 2) == bytes([90, 256 - 90])
    assert bus.write_read(ADDRESS, b"\x1c", 2) == b"\x00\xaa"


def test_bearing_is_read_once_a_transaction_at_its_instant(
    bus: I2cBusDouble, clock: ManualClock, attitude: Attitude
) -> None:
    clock.advance(7)
    bus.write_read(ADDRESS, b"\x01", 5)
    clock.advance(7)
    bus.write_read(ADDRESS, b"\x02", 2)
    assert attitude.asked_at == [7, 14]


def test_pointer_is_kept_and_moves_on(bus: I2cBusDouble) -> None:
    bus.write(ADDRESS, b"\x02")
    assert bus.read(ADDRESS, 1) == b"\x04"
    assert bus.read(ADDRESS, 1) == b"\xd2"


def test_calibration_state_is_what_the_world_says(bus: I2cBusDouble, compass: Cmps12Double) -> None:
    compass.calibration_state = 0x02
    assert bus.write_read(ADDRESS, b"\x1e", 1) == b"\x02"


def test_calibration_state_goes_back_to_the_stored_profile_at_power_up(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    compass.calibration_state = 0x3F
    bus.power_cycle()
    assert bus.write_read(ADDRESS, b"\x1e", 1) == b"\x33"
    compass.calibration_state = 0x3F
    command(bus, clock, 0xF0, 0xF5, 0xF6)
    compass.calibration_state = 0x00
    bus.power_cycle()
    assert bus.write_read(ADDRESS, b"\x1e", 1) == b"\x3f"
    assert compass.warnings == []


def test_an_erased_profile_leaves_the_compass_uncalibrated_after_power_up(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0xE0, 0xE5, 0xE2)
    assert bus.write_read(ADDRESS, b"\x1e", 1) == b"\x33"
    assert compass.stored_state is None
    bus.power_cycle()
    assert bus.write_read(ADDRESS, b"\x1e", 1) == b"\x00"


def test_address_changes_by_its_sequence_and_stays_over_a_power_cycle(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0xA0, 0xAA, 0xA5, 0xC4)
    bus.power_cycle()
    assert bus.write_read(0x62, b"\x00", 1) == b"\x07"
    with pytest.raises(NoAcknowledge):
        bus.write_read(ADDRESS, b"\x00", 1)
    assert compass.warnings == []


def test_bytes_closer_than_20_ms_are_lost_and_break_the_sequence_off(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0xF0, 0xF5, wait_ms=19)
    assert compass.warnings == [
        "CMPS12 0x61: command 0xf5 within 20 ms of the last; it is lost",
        "CMPS12 0x61: command sequence broken off after 1 bytes",
    ]
    clock.advance(20 * MILLISECOND)
    compass.calibration_state = 0x11
    command(bus, clock, 0xF6)
    assert compass.stored_state == 0x33


def test_any_other_command_breaks_a_sequence_off(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0xE0, 0xE5, 0xF0, 0xF5, 0xF6)
    assert compass.stored_state == 0x33
    assert compass.warnings == ["CMPS12 0x61: command sequence broken off after 2 bytes"]
    command(bus, clock, 0xA0, 0xAA, 0xA5, 0xC8)
    assert compass.address == 0x64


def test_an_impossible_new_address_is_ignored(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0xA0, 0xAA, 0xA5, 0xE0)
    assert compass.address == ADDRESS
    assert "not an even number from 0xc0 to 0xce" in compass.warnings[0]


def test_unknown_commands_and_read_only_registers_are_warned_of(
    bus: I2cBusDouble, clock: ManualClock, compass: Cmps12Double
) -> None:
    command(bus, clock, 0x55)
    bus.write(ADDRESS, b"\x04\x00")
    assert compass.warnings == [
        "CMPS12 0x61: command 0x55 does not exist; it is ignored",
        "CMPS12 0x61: register 0x04 is read-only; the write is ignored",
    ]


def test_a_compass_is_level_by_default(clock: ManualClock) -> None:
    bus = I2cBusDouble(
        "i2c-1", clock, [Cmps12Double(clock, bearing_deg=lambda _: 1.0, noise_seed=None)]
    )
    assert bus.write_read(0x60, b"\x02", 4) == b"\x00\x0a\x00\x00"
    assert bus.write_read(0x60, b"\x1e", 1) == b"\xff"


def test_an_address_outside_the_eight_is_refused(clock: ManualClock) -> None:
    with pytest.raises(ValueError, match="CMPS12: address is 0x68, expected 0x60 to 0x67"):
        Cmps12Double(clock, 0x68, bearing_deg=lambda _: 0.0, noise_seed=None)
