"""The raw sensors of a CMPS12, registers 6 to 23: what its BNO055 measures before it is a bearing.

Units are the BNO055's: 1/16 uT, 1/100 m/s2, 1/16 degree/s, big endian. The magnetometer sees a
field of 20 uT north and 40 uT down, the accelerometer gravity. Assumed, for the page is silent: x
is forward, y left and z up; pitch is positive nose up, roll positive with the right side down.

Source of the units: Bosch BNO055 data sheet, 3.6.4.
"""

import math
from struct import Struct
from typing import TypeAlias

Vector: TypeAlias = tuple[float, float, float]

NORTH_UT, DOWN_UT = 20.0, 40.0
GRAVITY_M_S2 = 9.80665
PER_UT, PER_M_S2, PER_DEGREE_S = 16, 100, 16
LARGEST = 32767

_RAW = Struct(">9h")


def raw_sensors(bearing_deg: float, pitch_deg: float, roll_deg: float, rate_rad_s: Vector) -> bytes:
    """Magnetometer, accelerometer and gyro, x, y and z of each, as 18 register bytes."""
    bearing = math.radians(bearing_deg)
    level_ut = (NORTH_UT * math.cos(bearing), NORTH_UT * math.sin(bearing), -DOWN_UT)
    field_ut = _tilted(level_ut, pitch_deg, roll_deg)
    force_m_s2 = _tilted((0.0, 0.0, GRAVITY_M_S2), pitch_deg, roll_deg)
    return _RAW.pack(
        *(_word(axis * PER_UT) for axis in field_ut),
        *(_word(axis * PER_M_S2) for axis in force_m_s2),
        *(_word(math.degrees(axis) * PER_DEGREE_S) for axis in rate_rad_s),
    )


def _tilted(level: Vector, pitch_deg: float, roll_deg: float) -> Vector:
    """What is `level` in level axes, in those of a compass that is pitched, then rolled."""
    pitch, roll = math.radians(pitch_deg), math.radians(roll_deg)
    x, y, z = level
    x, z = x * math.cos(pitch) + z * math.sin(pitch), z * math.cos(pitch) - x * math.sin(pitch)
    y, z = y * math.cos(roll) + z * math.sin(roll), z * math.cos(roll) - y * math.sin(roll)
    return (x, y, z)


def _word(value: float) -> int:
    return max(-LARGEST - 1, min(LARGEST, round(value)))
