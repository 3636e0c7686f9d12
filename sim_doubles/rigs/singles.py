"""One chip alone, as a double: on a bus or port of its own, in a world that swings gently.

For trying a chip's driver out with no hardware. Names are those of the command line's chips.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from firmware_runtime.devs.time import SECOND
from sim_doubles.chips.ads1115 import Ads1115Double
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.cmps12 import Cmps12Double
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target
from sim_doubles.inertial_truth import InertialTruth
from sim_doubles.serial_target import SerialTarget

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


def _inertial(now: Now, address: int) -> Sequence[Target]:
    magnetometer = Ak8963Double(now, _field)
    return Mpu9250Double(now, _inertia, address, magnetometer=magnetometer).targets


ON_BUS: Final[Mapping[str, Callable[[Now, int], Sequence[Target]]]] = MappingProxyType(
    {
        "mpu9250": _inertial,
        "ak8963": lambda now, _: _inertial(now, 0x68),
        "srf08": lambda now, address: [
            Srf08Double(now, address, echoes=lambda at: [_distance_m(at)])
        ],
        "cmps12": lambda now, address: [
            Cmps12Double(now, address, bearing_deg=lambda at: 90 - math.degrees(_angle(at)))
        ],
        "hmc5883l": lambda now, _: [Hmc5883lDouble(now, _field)],
        "ads1115": lambda now, address: [Ads1115Double(now, address, inputs=_voltages)],
        "pca9685": lambda now, address: [Pca9685Double(now, address)],
        "h_bridge": lambda now, address: [Pca9685Double(now, address)],
        "md25": lambda now, address: [Md25Double(now, address)],
    }
)
ON_PORT: Final[Mapping[str, Callable[[Now], SerialTarget]]] = MappingProxyType(
    {
        "maxbotix": lambda now: MaxbotixDouble(now, _distance_m),
        "sabertooth": SabertoothDouble,
    }
)
