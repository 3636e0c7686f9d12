"""Doubles by name for a test: at rest, unless the test says what they sense.

    make("srf08", now, echoes=[0.8])               # a wall at 0.8 m
    make("ads1115", now, inputs=lambda at: [...])  # volts at an instant in ns

What a chip senses is given as its double's class takes it, in SI, or as a constant.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from firmware_runtime.entry_points import installed
from firmware_runtime.errors import ConfigError
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
from sim_doubles.inertial_truth import InertialTruth

GROUP: Final = "firmware_runtime.chip_doubles"
FIELD_T: Final = (20e-6, 0.0, -40e-6)
LEVEL: Final = InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), FIELD_T, 25.0)


def _mpu9250(now: Now, *, inertia: Callable[[int], InertialTruth], **more: Any) -> Mpu9250Double:  # noqa: ANN401
    magnetometer = Ak8963Double(now, lambda at: inertia(at).field)
    return Mpu9250Double(now, inertia, magnetometer=magnetometer, **more)


_CHIPS: Final[Mapping[str, tuple[Callable[..., object], Mapping[str, object]]]] = {
    "ads1115": (Ads1115Double, {"inputs": (0.0, 0.0, 0.0, 0.0)}),
    "cmps12": (Cmps12Double, {"bearing_deg": 0.0}),
    "h_bridge": (Pca9685Double, {}),
    "hmc5883l": (Hmc5883lDouble, {"field": FIELD_T}),
    "maxbotix": (MaxbotixDouble, {"distance": 1.0}),
    "md25": (Md25Double, {}),
    "mpu9250": (_mpu9250, {"inertia": LEVEL}),
    "pca9685": (Pca9685Double, {}),
    "sabertooth": (SabertoothDouble, {}),
    "srf08": (Srf08Double, {"echoes": (1.0,)}),
}
"""Each double, and what it senses unless a test says otherwise."""
_SENSES: Final = frozenset(
    {"bearing_deg", "distance", "echoes", "field", "inertia", "inputs", "pitch_roll_deg"}
)
"""What is a function of the instant."""


def make(name: str, now: Now, **settings: object) -> object:
    """Make a double by its name, of ours or of a package with an entry point. Raises ConfigError.

    An `address` of None is the chip's own as shipped.
    """
    double, at_rest = _found(name)
    stated = {**at_rest, **{key: value for key, value in settings.items() if value is not None}}
    for sense in _SENSES & stated.keys():
        if not callable(stated[sense]):
            stated[sense] = partial(_always, stated[sense])
    try:
        return double(now, **stated)
    except (TypeError, ValueError) as error:
        raise ConfigError(name, [str(error)]) from error


def _found(name: str) -> tuple[Callable[..., object], Mapping[str, object]]:
    theirs = {each.name: each for each in installed(GROUP)}
    if name in _CHIPS:
        return _CHIPS[name]
    if name in theirs:
        return theirs[name].load(), {}
    known = ", ".join(sorted({*_CHIPS, *theirs}))
    raise ConfigError(name, [f"no chip of that name has a double; expected one of {known}"])


def _always(value: object, _at: int) -> object:
    return value
