"""The CMPS12's double by bytes; every expected value is worked out by hand."""

import math
import struct

import pytest

from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip, sentences

Turning = tuple[float, float, float]


class Wired(WiredChip[Cmps12Double]):
    """A compass that points where tests say, and the instants at which that was asked for."""

    def __init__(self, clock: ManualClock, rate_rad_s: Turning = (0.0, 0.0, 0.0)) -> None:
        self.bearing_deg = 123.42
        self.pitch_roll_deg = (-12.3, 45.6)
        self.asked_at: list[int] = []
        chip = Cmps12Double(
            clock,
            0x61,
            bearing_deg=self._bearing,
            pitch_roll_deg=lambda _: self.pitch_roll_deg,
            rate_rad_s=lambda _: rate_rad_s,
            calibration_state=0x33,
            temperature_c=-4.0,
            version=7,
            noise_seed=None,
        )
        super().__init__(clock, chip, 0x61, [chip])

    def _bearing(self, at: int) -> float:
        self.asked_at.append(at)
        return self.bearing_deg

    def raw(self) -> tuple[int, ...]:
        """Magnetometer, accelerometer and gyro by axis."""
        return struct.unpack(">9h", self.read(0x06, 18))


@pytest.fixture
def compass(clock: ManualClock) -> Wired:
    return Wired(clock)


def commands(*codes: int) -> str:
    """Commands, each given the 20 ms that it needs."""
    return "; ".join(f"W 00 {code:02x}; 20 ms" for code in codes)


STORE = commands(0xF0, 0xF5, 0xF6)


@sentences(
    {
        # version; 1234 / 3600 x 256 = 87.8; 1234; -12; 46
        "version, bearing, pitch and roll": "W 00, R 07 57 04 d2 f4 2e",
        # -4 degrees C; 1974.7 sixteenths; -12
        "temperature, the bearing in sixteenths, pitch and calibration": (
            "W 18, R 00 fc 07 b7 ff f4 33 ff"
        ),
        "the pointer is kept and moves on": "W 02; R 04; R d2",
        "the bearing is read once a transaction at its instant": (
            "7 ns; W 01, R 57 04 d2 f4 2e; 7 ns; W 02, R 04 d2; asked_at is [7, 14]"
        ),
        "an erased profile leaves the compass uncalibrated after power-up": (
            f"{commands(0xE0, 0xE5, 0xE2)}; W 1e, R 33; stored_state is None; power cycle; "
            "W 1e, R 00"
        ),
        "the address changes by its sequence and stays over a power cycle": (
            f"{commands(0xA0, 0xAA, 0xA5, 0xC4)}; power cycle; 0x62 W 00, R 07; "
            "W 00, R 07 -> refused"
        ),
        "bytes closer than 20 ms are lost and break the sequence off": (
            "W 00 f0; 19 ms; W 00 f5; 19 ms; warns command 0xf5 within 20 ms of the last; "
            "warns sequence broken off after 1 bytes; 20 ms; W 00 f6; stored_state is 0x33; "
            "warns command 0xf6 does not exist"
        ),
        "any other command breaks a sequence off": (
            f"{commands(0xE0, 0xE5)}; {STORE}; stored_state is 0x33; "
            f"warns sequence broken off after 2 bytes; {commands(0xA0, 0xAA, 0xA5, 0xC8)}; "
            "address is 0x64"
        ),
        "an impossible new address is ignored": (
            f"{commands(0xA0, 0xAA, 0xA5, 0xE0)}; address is 0x61; "
            "warns not an even number from 0xc0 to 0xce"
        ),
        "unknown commands and read-only registers are warned of": (
            "W 00 55; 20 ms; W 04 00; warns command 0x55 does not exist; "
            "warns register 0x04 is read-only"
        ),
    }
)
def test_registers_and_commands(compass: Wired, lines: str) -> None:
    compass.play(lines)


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
    compass: Wired,
    bearing_deg: float,
    pitch_roll_deg: tuple[float, float],
    field_and_force: tuple[int, ...],
) -> None:
    compass.bearing_deg, compass.pitch_roll_deg = bearing_deg, pitch_roll_deg
    assert compass.raw() == (*field_and_force, 0, 0, 0)


def test_raw_gyro_is_in_sixteenths_of_a_degree_a_second(clock: ManualClock) -> None:
    turning = (0.0, math.radians(-10.0), math.radians(90.0))
    assert Wired(clock, turning).raw()[6:] == (0, -160, 1440)


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
    compass: Wired, bearing_deg: float, tenths: int, of_256: int
) -> None:
    compass.bearing_deg = bearing_deg
    assert compass.read(0x01, 3) == bytes([of_256, *tenths.to_bytes(2, "big")])


def test_pitch_and_roll_end_at_90_degrees(compass: Wired) -> None:
    compass.pitch_roll_deg = (170.0, -95.0)
    compass.play("W 04, R 5a a6; W 1c, R 00 aa")


def test_calibration_is_what_the_world_says_and_the_stored_profile_at_power_up(
    compass: Wired,
) -> None:
    compass.chip.calibration_state = 0x3F
    compass.play("W 1e, R 3f; power cycle; W 1e, R 33")
    compass.chip.calibration_state = 0x3F
    compass.play(STORE)
    compass.chip.calibration_state = 0x00
    compass.play("W 1e, R 00; power cycle; W 1e, R 3f")


def test_a_compass_is_level_and_calibrated_by_default(clock: ManualClock) -> None:
    chip = Cmps12Double(clock, bearing_deg=lambda _: 1.0, noise_seed=None)
    WiredChip(clock, chip, 0x60, [chip]).play("W 02, R 00 0a 00 00; W 1e, R ff")


def test_its_content_is_what_is_read(compass: Wired) -> None:
    compass.bearing_deg = 200.0
    content = compass.chip.content
    assert compass.read(0x00, 31) == content
