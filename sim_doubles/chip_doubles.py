"""Doubles of single chips by name: ours and those of other packages, found by entry point.

An entry point of the group `firmware_runtime.chip_doubles` is a function, or the double's class:

    make(now, address=0x40)    a chip on an I2C bus: a target, or several
    make(now)                  a chip on a serial line: a serial target

The default of `address` is where a new chip is. One that has a fixed address, or only some, raises
ValueError for another. An address that the class of a serial target has is none on a bus.
"""

import inspect
from collections.abc import Callable, Sequence
from typing import NamedTuple

from firmware_runtime.errors import ConfigError, expected_one_of
from firmware_runtime.system.packages import EntryPoint, installed
from sim_doubles.clock import Now
from sim_doubles.i2c_target import Target
from sim_doubles.serial_line import SerialTarget

GROUP = "firmware_runtime.chip_doubles"


class ChipDouble(NamedTuple):
    """Maker of the doubles of one kind of chip."""

    name: str
    make: Callable[..., object]
    address: int | None
    """Address of a new chip; None for a chip on a serial line."""

    def on_bus(self, now: Now, address: int) -> Sequence[Target]:
        """The targets to put on a bus; the first is the chip's own. Raises ConfigError."""
        try:
            made = self.make(now, address=address)
        except ValueError as error:
            raise ConfigError(f"{self.name}@0x{address:02x}", [str(error)]) from error
        return (made,) if isinstance(made, Target) else tuple(_targets(self.name, made))

    def on_port(self, now: Now) -> SerialTarget:
        """The target at the end of a serial line. Raises ConfigError."""
        made = self.make(now)
        if not isinstance(made, SerialTarget):
            raise _of_another_kind(self.name, "a SerialTarget", made)
        return made


def names() -> list[str]:
    """The chips that have a double, in alphabetical order."""
    return sorted(each.name for each in installed(GROUP))


def chip_double(name: str) -> ChipDouble:
    """The double of that name. Raises ConfigError if there is none, or it cannot be loaded."""
    for each in installed(GROUP):
        if each.name == name:
            return _loaded(each)
    known = names()
    raise ConfigError(name, [f"no double of that name; {expected_one_of(name, known)}"])


def _loaded(entry_point: EntryPoint) -> ChipDouble:
    name = entry_point.name
    try:
        make = entry_point.load()
        parameter = inspect.signature(make).parameters.get("address")
    except Exception as error:
        fault = f"its double cannot be loaded from {entry_point.value}: {error}"
        raise ConfigError(name, [fault]) from error
    is_serial = isinstance(make, type) and issubclass(make, SerialTarget)
    address = None if parameter is None or is_serial else parameter.default
    if address is not None and not isinstance(address, int):
        fault = f"{entry_point.value}: its address has no default; expected that of a new chip"
        raise ConfigError(name, [fault])
    return ChipDouble(name, make, address)


def _targets(name: str, made: object) -> Sequence[Target]:
    if isinstance(made, Sequence) and made and all(isinstance(each, Target) for each in made):
        return made
    raise _of_another_kind(name, "a Target or several", made)


def _of_another_kind(name: str, expected: str, made: object) -> ConfigError:
    fault = f"its entry point makes {type(made).__name__}, expected {expected}"
    return ConfigError(name, [fault])
