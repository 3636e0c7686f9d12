"""The one bus or port that a chip which is tried out hangs on: a real one, or its double's.

What makes doubles is found by entry point, and imported only when they are asked for.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from time import monotonic_ns
from typing import Final, NamedTuple, TypeAlias, cast

from firmware_drivers.catalogue.trial import Actuator, OnBus, Sensor, Triable
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.accounted_bus import THREE_ATTEMPTS, AccountedBus
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.system.packages import installed
from firmware_runtime.system.whole_numbers import whole_number

BUS: Final = "/dev/i2c-1"
"""The bus on the pin header of every Raspberry Pi."""
PORT: Final = "/dev/serial0"
BUS_HZ: Final = 400_000
SINGLE_DOUBLES: Final = "firmware_runtime.single_doubles"
"""One entry point: a function of a chip's name and its address, None on a serial line. It returns
the line of the chip's double, and the clock it lives on, whose `look` gives the instant in ns."""

Now: TypeAlias = Callable[[], int]


class Single(NamedTuple):
    """A chip on its line, and the clock it lives by."""

    chip: Sensor | Actuator
    now: Now
    """The present instant, ns; a double's time goes on with each reading."""


def device_of(bus: str) -> str:
    """The device node of a bus given by its number or its node."""
    number = whole_number(bus)
    return bus if number is None else f"/dev/i2c-{number}"


@contextmanager
def single(chip: Triable, arguments: argparse.Namespace) -> Iterator[Single]:
    """Open its line, for this process alone, and build its driver; nothing is sent yet.

    Raises HalError, BusInUse where a run drives the line; SettingError for options that do not fit;
    ConfigError for a double that is not there.
    """
    address: int | None = arguments.address if isinstance(chip, OnBus) else None
    line, now = _double(chip, address) if arguments.doubles else (_line(chip, arguments), None)
    options = vars(arguments)
    if isinstance(chip, OnBus):
        with closing(AccountedBus(cast("I2cBus", line), BUS_HZ, THREE_ATTEMPTS)) as bus:
            yield Single(chip.build(bus, arguments.address, options), now or monotonic_ns)
    else:
        with closing(cast("SerialPort", line)) as port:
            yield Single(chip.build(port, options), now or monotonic_ns)


def _line(chip: Triable, arguments: argparse.Namespace) -> I2cBus | SerialPort:
    if isinstance(chip, OnBus):
        device = device_of(arguments.bus)
        return open_i2c(Path(device).name, device, alone=True)
    return open_serial(Path(arguments.port).name, arguments.port, chip.baud)


def _double(chip: Triable, address: int | None) -> tuple[I2cBus | SerialPort, Now]:
    """The line of its double, and the instant there. Raises ConfigError."""
    for each in installed(SINGLE_DOUBLES):
        line, clock = each.load()(chip.name, address)
        return line, clock.look
    fault = f"no doubles are installed; expected an entry point of the group {SINGLE_DOUBLES}"
    raise ConfigError(f"try {chip.name}", [fault])
