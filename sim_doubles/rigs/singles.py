"""One chip alone, as a double: on a bus or port of its own, in a world that swings gently.

For trying a chip's driver out with no hardware. These are entry points, by the names of the command
line's chips; what needs no world is its class.
"""

import math
from collections.abc import Sequence
from typing import Final

from firmware_runtime.devs.time import SECOND
from sim_doubles.chip_doubles import chip_double
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import Now
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth
from sim_doubles.serial_line import SerialLineDouble
from sim_doubles.served.server import RealClock

BUS_HZ: Final = 400_000
PERIOD_S: Final = 10.0
GRAVITY: Final = 9.80665
FIELD_LEVEL_T, FIELD_UP_T = 20e-6, -40e-6


def _angle(at: int) -> float:
    """What turns to and fro by half a radian, in rad."""
    return 0.5 * math.sin(math.tau * at / SECOND / PERIOD_S)


def _rate(at: int) -> float:
    return 0.5 * math.tau / PERIOD_S * math.cos(math.tau * at / SECOND / PERIOD_S)


def _field(at: int) -> tuple[float, float, float]:
    angle = _angle(at)
    return (FIELD_LEVEL_T * math.cos(angle), -FIELD_LEVEL_T * math.sin(angle), FIELD_UP_T)


def _inertia(at: int) -> InertialTruth:
    return InertialTruth((0.0, 0.0, GRAVITY), (0.0, 0.0, _rate(at)), _field(at), 25.0)


def _voltages(at: int) -> tuple[float, float, float, float]:
    return (1.0 + _angle(at), 1.0 - _angle(at), 3.3, 0.0)


def _distance_m(at: int) -> float:
    return 1.0 + _angle(at)


def mpu9250(now: Now, address: int = 0x68) -> Sequence[Target]:
    """An MPU-9250 with its magnetometer, which answers while the bypass is open."""
    magnetometer = Ak8963Double(now, _field)
    return Mpu9250Double(now, _inertia, address, magnetometer=magnetometer).targets


def ak8963(now: Now, address: int = 0x0C) -> Sequence[Target]:
    """The magnetometer in an MPU-9250 at 0x68, which must open its bypass."""
    _only_at(0x0C, address)
    return mpu9250(now)


def srf08(now: Now, address: int = 0x70) -> Srf08Double:
    """A sonar before a wall that comes and goes."""
    return Srf08Double(now, address, echoes=lambda at: [_distance_m(at)])


def cmps12(now: Now, address: int = 0x60) -> Cmps12Double:
    """A compass on a turntable that turns to and fro about west."""
    return Cmps12Double(now, address, bearing_deg=lambda at: 90 - math.degrees(_angle(at)))


def hmc5883l(now: Now, address: int = 0x1E) -> Hmc5883lDouble:
    """A magnetometer on the same turntable."""
    _only_at(0x1E, address)
    return Hmc5883lDouble(now, _field)


def ads1115(now: Now, address: int = 0x48) -> Ads1115Double:
    """A converter with two voltages about 1 V, 3.3 V and ground at its inputs."""
    return Ads1115Double(now, address, inputs=_voltages)


def maxbotix(now: Now) -> MaxbotixDouble:
    """A sonar on a serial line before the same wall."""
    return MaxbotixDouble(now, _distance_m)


def sabertooth(now: Now) -> SabertoothDouble:
    """A motor driver with its switches as shipped."""
    return SabertoothDouble(now)


def _only_at(address: int, wanted: int) -> None:
    if wanted != address:
        raise ValueError(f"address: 0x{wanted:02x}, expected 0x{address:02x}, which is fixed")


def single(name: str, address: int | None) -> tuple[I2cBusDouble | SerialLineDouble, RealClock]:
    """The line of one chip's double in real time, and its clock. Raises ConfigError.

    `address` is None for a chip on a serial line.
    """
    clock, chip = RealClock(), chip_double(name)
    if address is None:
        return SerialLineDouble("double", clock, chip.on_port(clock)), clock
    targets = chip.on_bus(clock, address)
    return I2cBusDouble("double", clock, targets, bus_hz=BUS_HZ, reach=clock.reach), clock
