"""Trials of chips: functions that read one, or move it and switch it off.

Nothing here waits: what takes time is a `Step`, as in every driver, and the caller lets
it pass.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from firmware_drivers.chips.step import Step
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort

Steps: TypeAlias = Callable[[], Sequence[Step]]


class Quantity(NamedTuple):
    """One reading in SI units under a key that names them; None where there is no value now.

    For people it is shown as `label value unit`, times `scale`.
    """

    key: str
    value: float | tuple[float, ...] | None
    label: str
    unit: str
    decimals: int = 2
    scale: float = 1.0


Reading: TypeAlias = Sequence[Quantity]


def nothing() -> None:
    """Do nothing: what most sensors need at the end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """A chip that is read: `bring_up` once, then `measure` and `read`, then `end`."""

    place: str
    """Name of the chip and its place."""
    bring_up: Steps
    read: Callable[[], Reading]
    """Raises HalError; NotReady where there is no value."""
    measure: Steps = tuple
    """Steps of one measurement before it can be read."""
    end: Callable[[], None] = nothing
    """Leaves the chip as others expect it. Raises HalError."""
    warnings: Sequence[str] = ()
    """Warnings of what works less well than it should; there after the bring-up."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Actuator:
    """A chip that moves something: what was asked for when this was made, and nothing else."""

    place: str
    promise: str
    """Announcement of the movement, for the person who has to agree."""
    bring_up: Steps
    move: Callable[[], Reading]
    """Does it, and gives what the chip said. Raises HalError."""
    off: Callable[[], None]
    """Switches off, in any state of the chip. Raises HalError."""
    repeat_ns: int
    """Period of `move`: the chip would stop by itself, or must be looked after."""


class Option(NamedTuple):
    """Something to say about a chip on the command line: `--name VALUE`."""

    name: str
    kind: Callable[[str], Any]
    help: str
    default: Any = None
    least: float | None = None
    most: float | None = None
    choices: Sequence[str] | None = None
    required: bool = False


Options: TypeAlias = Mapping[str, Any]
"""Values of a chip's options, by their names with underscores for dashes."""


class Identity(NamedTuple):
    """A chip, where it may be, and the question that decides.

    `evidence` reads, and returns what it saw, in words; it raises WrongDevice if that is no such
    chip, and other errors of the bus. Only an identity register makes it `certain`.
    """

    chip: str
    """As boards name it."""
    addresses: Collection[int]
    evidence: Callable[[I2cBus, int], str]
    certain: bool = False
    usable: bool = True
    """True if a driver can do something with it there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OnBus:
    """A chip on an I2C bus; `build` raises SettingError for options that do not fit."""

    name: str
    """Name on the command line."""
    title: str
    address: int
    addresses: Collection[int]
    build: Callable[[I2cBus, int, Options], Sensor | Actuator]
    options: Sequence[Option] = ()
    moves: bool = False
    """True if `build` makes an `Actuator`; else a `Sensor`."""
    identity: Identity | None = None
    """Its identity; None for a part of another chip, or if it cannot be recognised."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OnPort:
    """A chip on a serial port; `build` raises SettingError for options that do not fit."""

    name: str
    title: str
    baud: int
    build: Callable[[SerialPort, Options], Sensor | Actuator]
    options: Sequence[Option] = ()
    moves: bool = False
    """True if `build` makes an `Actuator`; else a `Sensor`."""


Triable: TypeAlias = OnBus | OnPort
