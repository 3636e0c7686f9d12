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
from sim_doubles.clock import Now
from sim_doubles.inertial_truth import InertialTruth

FIELD_T: Final = (20e-6, 0.0, -40e-6)
LEVEL: Final = InertialTruth((0.0, 0.0, 9.80665), (0.0, 0.0, 0.0), FIELD_T, 25.0)

_AT_REST: Final[Mapping[str, Mapping[str, object]]] = {
    "ads1115": {"inputs": (0.0, 0.0, 0.0, 0.0)},
    "cmps12": {"bearing_deg": 0.0},
    "hmc5883l": {"field": FIELD_T},
    "maxbotix": {"distance": 1.0},
    "mpu9250": {"inertia": LEVEL},
    "srf08": {"echoes": (1.0,)},
}
"""Truth of a chip unless a test says otherwise; as entry points they are in a world."""
_SENSES: Final = frozenset(
    {"bearing_deg", "distance", "echoes", "field", "inertia", "inputs", "pitch_roll_deg"}
)
"""Quantities that are functions of the instant."""


def make(name: str, now: Now, /, **settings: object) -> object:
    """Make a double by its name, of ours or of a package with an entry point. Raises ConfigError.

    An `address` of None is the chip's own as shipped.
    """
    double = chip_double(name).make
    given = dict(settings)
    if given.get("address", ...) is None:
        del given["address"]
    _check(name, double, given)
    stated = {**_AT_REST.get(name, {}), **given}
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
    """Return the fault of a value of this type, or of a constant in a sense's place."""
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
