"""Double of the Devantech CMPS12, a tilt-compensated compass on I2C. Source: Devantech's page.

Modelled: bearing in 0.1 degree and in 256ths, the BNO055's own in 16ths of a degree, pitch, roll,
the raw sensors as they follow from these, temperature, calibration state, version;
the three command sequences with the 20 ms after each byte: store and erase the calibration profile,
change the address. The CMPS14 is the same up to register 5, in register 30 and in the change of
address.

The raw sensors, registers 6 to 23, are what its BNO055 measures before it is a bearing, in units of
1/16 uT, 1/100 m/s2 and 1/16 degree/s, big endian (Bosch BNO055 data sheet, 3.6.4). The magnetometer
sees a field of 20 uT north and 40 uT down, the accelerometer gravity. Assumed, for the page is
silent: x is forward, y left and z up; pitch is positive nose up, roll positive with the right side
down.

The raw magnetometer has its noise, 0.6 uT (Bosch BMM150 data sheet, regular preset), new twenty
times a second. Not modelled: calibrating by motion: the test or the world sets `calibration_state`;
the 10 ms or so between the compass's own updates; noise of the other raw sensors. Assumed where the
page is silent: values are rounded to the nearest unit and taken at START, so that both bytes of a
bearing belong together; the 256ths are cut off; a byte within 20 ms of the last is lost and breaks
a sequence off; after power-up the calibration state is the stored profile's, 0 without one;
registers above 30 read 0xFF.
"""

import math
from collections.abc import Callable
from struct import Struct

from firmware_runtime.devs.time import MILLISECOND, NEVER
from sim_doubles.chips.devantech import CommandSequence, DevantechDouble
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Words
from sim_doubles.inertial_truth import Vector
from sim_doubles.worlds.noise import part_noise

ADDRESSES = range(0x60, 0x68)

COMMAND = 0  # reads as the software version
BEARING_256 = 1
BEARING = 2
PITCH = 4
ROLL = 5
RAW = 6
TEMPERATURE = 25
BNO055_BEARING = 26
PITCH_180 = 28
CALIBRATION = 30
REGISTERS = 31

STORE_PROFILE = (0xF0, 0xF5, 0xF6)
ERASE_PROFILE = (0xE0, 0xE5, 0xE2)
BETWEEN_COMMANDS = 20 * MILLISECOND

CALIBRATED = 0xFF  # system, gyro, accelerometer, magnetometer: 3 each

NORTH_UT, DOWN_UT = 20.0, 40.0
GRAVITY_M_S2 = 9.80665
NOISE_UT, MAGNETOMETER_PERIOD = 0.6, 50 * MILLISECOND
PER_UT, PER_M_S2, PER_DEGREE_S = 16, 100, 16
LARGEST = 32767

_RAW = Struct(">9h")


def _level(_at: int) -> tuple[float, float]:
    return (0.0, 0.0)


def _at_rest(_at: int) -> Vector:
    return (0.0, 0.0, 0.0)


class Cmps12Double(DevantechDouble):
    """A CMPS12; `bearing_deg` gives the compass bearing in degrees, clockwise from north.

    `pitch_roll_deg` gives both in degrees, `rate_rad_s` what the raw gyro measures. Each is called
    once a transaction, at an instant in ns. World face: `calibration_state` as register 30 shows
    it, `temperature_c`; `stored_state` is the state the stored profile holds, None without one;
    from `hangs_from` on, an instant in ns, no register changes. `noise_seed` chooses the noise;
    None for exact values.
    """

    measured = (Words(2, 1, is_signed=False), Words(6, 3))
    """Bearing and raw field."""

    def __init__(  # noqa: PLR0913 (what varies between modules, one line each)
        self,
        now: Now,
        address: int = ADDRESSES[0],
        *,
        bearing_deg: Callable[[int], float],
        pitch_roll_deg: Callable[[int], tuple[float, float]] = _level,
        rate_rad_s: Callable[[int], Vector] = _at_rest,
        calibration_state: int = CALIBRATED,
        temperature_c: float = 25.0,
        version: int = 7,
        noise_seed: int | None = 1,
    ) -> None:
        super().__init__(now, "CMPS12", address, ADDRESSES)
        self.calibration_state = calibration_state
        self.stored_state: int | None = calibration_state
        self.temperature_c = temperature_c
        self._bearing_deg = bearing_deg
        self._pitch_roll_deg = pitch_roll_deg
        self._rate_rad_s = rate_rad_s
        self._version = version
        self._noise = part_noise(f"CMPS12 0x{address:02x}", noise_seed, NOISE_UT)
        self.hangs_from = NEVER
        self._registers = bytes(REGISTERS)
        self._next_command_at = self._at
        self._sequences += (
            CommandSequence(STORE_PROFILE, self._store, self.warnings),
            CommandSequence(ERASE_PROFILE, self._erase, self.warnings),
        )

    def _reset(self) -> None:
        """Be calibrated as stored, or not at all."""
        super()._reset()
        self._next_command_at = self._at
        self.calibration_state = self.stored_state or 0

    @property
    def content(self) -> bytes:
        """Return what stands in its 31 registers now."""
        self._at = self._now()
        self._begin()
        return self._registers

    # Bus face

    def _begin(self) -> None:
        if self._at < self.hangs_from:
            self._registers = self._measured()

    def _read_register(self, register: int) -> int:
        return self._registers[register] if register < REGISTERS else 0xFF

    def _write_register(self, register: int, byte: int) -> None:
        if register == COMMAND:
            self._take_command(byte)
        else:
            self.warnings.note(f"register 0x{register:02x} is read-only; the write is ignored")

    # Commands

    def _take_command(self, byte: int) -> None:
        early = self._at < self._next_command_at
        self._next_command_at = self._at + BETWEEN_COMMANDS
        if early:
            self.warnings.note(f"command 0x{byte:02x} within 20 ms of the last; it is lost")
            self._break_off()
        else:
            super()._take_command(byte)

    def _store(self, _byte: int) -> None:
        self.stored_state = self.calibration_state

    def _erase(self, _byte: int) -> None:
        self.stored_state = None

    # Measuring

    def _measured(self) -> bytes:
        """Return all registers as they are at this instant."""
        bearing, (pitch, roll) = self._bearing_deg(self._at), self._pitch_roll_deg(self._at)
        tenths = round(bearing * 10) % 3600
        registers = bytearray(REGISTERS)
        registers[COMMAND] = self._version
        registers[BEARING_256] = tenths * 256 // 3600
        registers[BEARING : BEARING + 2] = tenths.to_bytes(2, "big")
        registers[PITCH] = _whole(pitch, 90) & 0xFF
        registers[ROLL] = _whole(roll, 90) & 0xFF
        noise_ut = (0.0, 0.0, 0.0)
        if self._noise is not None:
            noise_ut = self._noise.at(self._at // MAGNETOMETER_PERIOD)
        raw = raw_sensors(bearing, pitch, roll, self._rate_rad_s(self._at), noise_ut)
        registers[RAW : RAW + len(raw)] = raw
        registers[TEMPERATURE] = _whole(self.temperature_c, 127) & 0xFF
        sixteenths = round(bearing * 16) % 5760
        registers[BNO055_BEARING : BNO055_BEARING + 2] = sixteenths.to_bytes(2, "big")
        registers[PITCH_180 : PITCH_180 + 2] = _whole(pitch, 180).to_bytes(2, "big", signed=True)
        registers[CALIBRATION] = self.calibration_state
        return bytes(registers)


def _whole(value: float, largest: int) -> int:
    """Return the nearest whole number within plus and minus `largest`."""
    return max(-largest, min(largest, round(value)))


def raw_sensors(
    bearing_deg: float,
    pitch_deg: float,
    roll_deg: float,
    rate_rad_s: Vector,
    noise_ut: Vector = (0.0, 0.0, 0.0),
) -> bytes:
    """Magnetometer, accelerometer and gyro, x, y and z of each, as 18 register bytes."""
    bearing = math.radians(bearing_deg)
    level_ut = (NORTH_UT * math.cos(bearing), NORTH_UT * math.sin(bearing), -DOWN_UT)
    field_ut = _tilted(level_ut, pitch_deg, roll_deg)
    force_m_s2 = _tilted((0.0, 0.0, GRAVITY_M_S2), pitch_deg, roll_deg)
    return _RAW.pack(
        *(_word((axis + noise) * PER_UT) for axis, noise in zip(field_ut, noise_ut, strict=True)),
        *(_word(axis * PER_M_S2) for axis in force_m_s2),
        *(_word(math.degrees(axis) * PER_DEGREE_S) for axis in rate_rad_s),
    )


def _tilted(level: Vector, pitch_deg: float, roll_deg: float) -> Vector:
    """Return `level`, of level axes, in the axes of a compass that is pitched, then rolled."""
    pitch, roll = math.radians(pitch_deg), math.radians(roll_deg)
    x, y, z = level
    x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
    y, z = y * math.cos(roll) + z * math.sin(roll), z * math.cos(roll) - y * math.sin(roll)
    return (x, y, z)


def _word(value: float) -> int:
    return max(-LARGEST - 1, min(LARGEST, round(value)))
