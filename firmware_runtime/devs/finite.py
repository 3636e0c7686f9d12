"""Numbers that are not finite do not enter a model: a NaN would stay in its state without end.

NaN passes a clamp of `min` and `max` as the limit, and every sum and filter keeps it, so one
measurement that is no number would be full command from then on. An input port therefore takes
finite numbers only, unless its model declares otherwise: `takes="infinities"` where +inf has a
meaning, as a sonar's "no echo" has; `takes="any"` where the model checks for itself, as an actuator
does, which has to stop. What a port does not take is not delivered, as if it had not been sent; the
engine reports it, and the executive counts it as a fault of the model that misses it.

Which wires carry floats is known when the couplings are resolved. On all others nothing is checked.
"""

from collections.abc import Callable, Iterable
from functools import cache, partial
from math import isfinite
from types import NoneType
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.ports import Check, InPort, OutPort, Takes

Refuse: TypeAlias = Callable[[InPort[Any], object], None]
"""Called with a port, and a value that is not delivered to it."""

_WITHOUT_FLOATS: Final = frozenset({int, bool, str, bytes, NoneType})
_NAMES_WITHOUT_FLOATS: Final = frozenset({"int", "bool", "str", "bytes", "None"})


def all_numbers(value: object, are_sound: Check = isfinite) -> bool:
    """Return whether every float in a value is sound: alone, in a sequence or in a record."""
    if isinstance(value, float):
        return are_sound(value)
    if isinstance(value, complex):
        return are_sound(value.real) and are_sound(value.imag)
    if isinstance(value, tuple | list):
        return all_items(value, are_sound)
    fields = _fields_of(type(value))
    return all_items([getattr(value, name, None) for name in fields], are_sound)


def all_items(values: Iterable[object], are_sound: Check = isfinite) -> bool:
    """Return whether every float in these values is sound. One call for a record of vectors."""
    for each in values:
        kind = type(each)
        if kind is float:
            if not are_sound(each):
                return False
        elif kind is tuple:
            try:
                if not all(map(are_sound, each)):  # type: ignore[call-overload]  # a tuple
                    return False
            except TypeError:  # not all of them are numbers
                if not all_items(each, are_sound):  # type: ignore[arg-type]
                    return False
        elif kind not in _WITHOUT_FLOATS and not all_numbers(each, are_sound):
            return False
    return True


def check_of(port: InPort[object]) -> Check | None:
    """Return what checks the values that enter a port; None where it takes all of its type."""
    return _check_for(port.type, port.takes)  # type: ignore[arg-type]  # a class has a hash


@cache
def _check_for(kind: type[object], takes: Takes) -> Check | None:
    if takes == "any" or not _may_hold_floats(kind):
        return None
    are_sound = isfinite if takes == "finite" else _is_number
    if issubclass(kind, float):
        return are_sound
    if issubclass(kind, tuple):
        return partial(all_items, are_sound=are_sound)
    return partial(all_numbers, are_sound=are_sound)


def check_of_all(port: OutPort[object], ends: Iterable[InPort[object]]) -> Check | None:
    """Return a check that is true of what all these ends of a port take; None if they take all."""
    if issubclass(port.type, int):
        return None
    checks = {check for end in ends if (check := check_of(end)) is not None}
    if len(checks) < 2:
        return checks.pop() if checks else None
    return lambda value: all(check(value) for check in checks)


def takes(end: InPort[object], value: object) -> bool:
    """Return whether a value gets into a bag."""
    check = check_of(end)
    try:
        return check is None or check(value)
    except TypeError:  # of another type than the port's: for the checked mode to find
        return True
    except OverflowError:  # a whole number beyond every float
        return False


def _is_number(value: float) -> bool:
    return value == value  # noqa: PLR0124 -- NaN alone is not


def _may_hold_floats(kind: type[object]) -> bool:
    if issubclass(kind, float | complex | list) or kind is tuple:
        return True
    if not issubclass(kind, tuple) and not _fields_of(kind):
        return False
    annotations = _annotations_of(kind)
    return not annotations or not annotations <= _WITHOUT_FLOATS | _NAMES_WITHOUT_FLOATS


def _fields_of(kind: type[object]) -> Iterable[str]:
    """The fields of a msgspec Struct or a dataclass; none of any other class."""
    fields: Iterable[str] = getattr(kind, "__struct_fields__", ())
    return fields or getattr(kind, "__dataclass_fields__", ())


def _annotations_of(kind: type[object]) -> set[object]:
    """What stands behind the fields' names, of all bases; nothing where it cannot be had."""
    try:
        return {
            each if getattr(each, "__hash__", None) else repr(each)
            for base in kind.__mro__
            for each in getattr(base, "__annotations__", {}).values()
        }
    except NameError:  # a name that only a type checker imports
        return set()
