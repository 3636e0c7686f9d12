"""Doubles by name for a test: at rest, unless the test says what they sense.

    make("srf08", now, echoes=[0.8])               # a wall at 0.8 m
    make("ads1115", now, inputs=lambda at: [...])  # volts at an instant in ns

What a chip senses is given as its double's class takes it, in SI, or as a constant.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import Parameter, signature
from typing import Final, get_args, get_origin

from msgspec import ValidationError, convert

from firmware_runtime.errors import ConfigError
from sim_doubles.chip_doubles import chip_double
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

FIELD_T: Final = (20e-6, 0.0, -40e-6)
LEVEL: Final = InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), FIELD_T, 25.0)


def _mpu9250(
    now: Now,
    address: int = 0x68,
    *,
    inertia: Callable[[int], InertialTruth],
    who_am_i: int = 0x71,
) -> Mpu9250Double:
    magnetometer = Ak8963Double(now, lambda at: inertia(at).field)
    return Mpu9250Double(now, inertia, address, who_am_i=who_am_i, magnetometer=magnetometer)


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


def make(name: str, now: Now, /, **settings: object) -> object:
    """Make a double by its name, of ours or of a package with an entry point. Raises ConfigError.

    An `address` of None is the chip's own as shipped.
    """
    double, at_rest = _CHIPS[name] if name in _CHIPS else (chip_double(name).make, {})
    given = {key: value for key, value in settings.items() if value is not None}
    _check(name, double, given)
    stated = {**at_rest, **given}
    for sense in _SENSES & stated.keys():
        if not callable(stated[sense]):
            stated[sense] = partial(_always, stated[sense])
    try:
        return double(now, **stated)
    except (TypeError, ValueError) as error:
        raise ConfigError(name, [str(error)]) from error


def _check(name: str, double: Callable[..., object], settings: Mapping[str, object]) -> None:
    """Refuse settings that a double does not have or cannot take, each by its name."""
    _now, *parameters = _parameters(double)
    known = ", ".join(each.name for each in parameters)
    faults = [
        f"{key}: no such setting; expected of {known}"
        for key in sorted(settings.keys() - {each.name for each in parameters})
    ]
    for each in parameters:
        if each.name in settings and each.annotation is not each.empty:
            faults += _value_faults(each.name, settings[each.name], each.annotation)
    if faults:
        raise ConfigError(name, faults)


def _parameters(double: Callable[..., object]) -> Sequence[Parameter]:
    try:
        return [*signature(double, eval_str=True).parameters.values()]
    except NameError:  # of a type that is there for type checkers alone
        return [*signature(double).parameters.values()]


def _value_faults(key: str, value: object, type_: object) -> list[str]:
    """What is wrong with a value of this type, or a constant in a sense's place."""
    if get_origin(type_) is Callable:
        if callable(value):
            return []
        type_ = get_args(type_)[1]
    try:
        convert(_without_numpy(value), type_)
    except ValidationError as error:
        found = str(error).replace("`", "")
        return [f"{key}: {value!r}: {found[:1].lower()}{found[1:]}"]
    except TypeError:  # a type that is no value's
        pass
    return []


def _without_numpy(value: object) -> object:
    """The value in types that msgspec knows, at any depth."""
    to_list = getattr(value, "tolist", None)
    if to_list is not None:
        return to_list()
    return [*map(_without_numpy, value)] if isinstance(value, tuple | list) else value


def _always(value: object, _at: int) -> object:
    return value
