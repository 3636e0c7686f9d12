"""One chip alone, as a double: on a bus or port of its own, in a world that swings gently.

For trying a chip's driver out with no hardware. These are entry points, by the names of the command
line's chips; what needs no world is its class. What a chip senses can be stated instead, as its
double's class takes it.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Final

from firmware_runtime.devs.time import SECOND
from sim_doubles.chip_doubles import chip_double
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import Now
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth, Vector
from sim_doubles.serial_line import SerialLineDouble
from sim_doubles.served.server import RealClock

BUS_HZ: Final = 400_000
PERIOD_S: Final = 10.0
GRAVITY: Final = 9.80665
FIELD_LEVEL_T, FIELD_UP_T = 20e-6, -40e-6


def _angle(at: int) -> float:
    """Return an angle that turns to and fro by half a radian, rad."""
    return 0.5 * math.sin(math.tau * at / SECOND / PERIOD_S)


def _rate(at: int) -> float:
    return 0.5 * math.tau / PERIOD_S * math.cos(math.tau * at / SECOND / PERIOD_S)


def _field(at: int) -> Vector:
    angle = _angle(at)
    return (FIELD_LEVEL_T * math.cos(angle), -FIELD_LEVEL_T * math.sin(angle), FIELD_UP_T)


def _inertia(at: int) -> InertialTruth:
    return InertialTruth((0.0, 0.0, GRAVITY), (0.0, 0.0, _rate(at)), _field(at), 25.0)


def _voltages(at: int) -> tuple[float, float, float, float]:
    return (1.0 + _angle(at), 1.0 - _angle(at), 3.3, 0.0)


def _distance_m(at: int) -> float:
    return 1.0 + _angle(at)


def _echoes(at: int) -> Sequence[float]:
    return [_distance_m(at)]


def _bearing_deg(at: int) -> float:
    return 90 - math.degrees(_angle(at))


def mpu9250(
    now: Now,
    address: int = 0x68,
    *,
    inertia: Callable[[int], InertialTruth] = _inertia,
    who_am_i: int = 0x71,
    noise_seed: int | None = 1,
) -> Sequence[Target]:
    """An MPU-9250 with its magnetometer, which answers while the bypass is open."""
    magnetometer = Ak8963Double(now, lambda at: inertia(at).field, noise_seed=noise_seed)
    return Mpu9250Double(
        now,
        inertia,
        address,
        who_am_i=who_am_i,
        magnetometer=magnetometer,
        noise_seed=noise_seed,
    ).targets


def ak8963(now: Now, address: int = 0x0C) -> Sequence[Target]:
    """The magnetometer in an MPU-9250 at 0x68, which must open its bypass."""
    _only_at(0x0C, address)
    return mpu9250(now)


def hmc5883l(
    now: Now,
    address: int = 0x1E,
    *,
    field: Callable[[int], Vector] = _field,
    noise_seed: int | None = 1,
) -> Hmc5883lDouble:
    """A magnetometer on a turntable that turns to and fro."""
    _only_at(0x1E, address)
    return Hmc5883lDouble(now, field, noise_seed=noise_seed)


srf08 = partial(Srf08Double, echoes=_echoes)
"""A sonar before a wall that comes and goes."""
cmps12 = partial(Cmps12Double, bearing_deg=_bearing_deg)
"""A compass on the same turntable, which turns about west."""
ads1115 = partial(Ads1115Double, inputs=_voltages)
"""A converter with two voltages about 1 V, 3.3 V and ground at its inputs."""
maxbotix = partial(MaxbotixDouble, distance=_distance_m)
"""A sonar on a serial line before the same wall."""


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
