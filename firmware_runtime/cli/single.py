"""The one bus or port that a chip which is tried out hangs on: a real one, or its double's.

What makes doubles is imported only when they are asked for.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from time import monotonic_ns
from typing import Final, NamedTuple, TypeAlias

from drivers.catalogue.trial import Actuator, OnBus, OnPort, Sensor, Triable
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.retry import THREE_ATTEMPTS
from firmware_runtime.hal.serial import SerialPort

BUS: Final = "/dev/i2c-1"
"""The bus on the pin header of every Raspberry Pi."""
PORT: Final = "/dev/serial0"
BUS_HZ: Final = 400_000

Now: TypeAlias = Callable[[], int]


class Single(NamedTuple):
    """A chip on its line, and the clock it lives by."""

    chip: Sensor | Actuator
    now: Now
    """The present instant, ns; a double's time goes on with each look."""


def device_of(bus: str) -> str:
    """The device node of a bus given by its number or its node."""
    return f"/dev/i2c-{int(bus)}" if bus.isdecimal() else bus


@contextmanager
def single(chip: Triable, arguments: argparse.Namespace) -> Iterator[Single]:
    """Open its line, for this process alone, and build its driver; nothing is sent yet.

    Raises HalError, BusInUse where a run drives the line; SettingError for options that do not fit.
    """
    now: Now = _clock() if arguments.doubles else monotonic_ns
    if isinstance(chip, OnBus):
        bus = _bus_double(chip, arguments.address, now) if arguments.doubles else _bus(arguments)
        with closing(AccountedBus(bus, BUS_HZ, THREE_ATTEMPTS)) as line:
            yield Single(chip.build(line, arguments.address, vars(arguments)), now)
    else:
        double = arguments.doubles
        with closing(_port_double(chip, now) if double else _port(chip, arguments)) as port:
            yield Single(chip.build(port, vars(arguments)), now)


def _bus(arguments: argparse.Namespace) -> I2cBus:
    device = device_of(arguments.bus)
    return open_i2c(Path(device).name, device, alone=True)


def _port(chip: OnPort, arguments: argparse.Namespace) -> SerialPort:
    return open_serial(Path(arguments.port).name, arguments.port, chip.baud)


# Doubles -----------------------------------------------------------------------------------------


def _clock() -> Now:
    look: Now = import_module("sim_doubles.served.server").RealClock().look
    return look


def _bus_double(chip: OnBus, address: int, now: Now) -> I2cBus:
    targets = import_module("sim_doubles.benches.singles").ON_BUS[chip.name](now, address)
    double: I2cBus = import_module("sim_doubles.i2c_bus").I2cBusDouble("double", now, targets)
    return double


def _port_double(chip: OnPort, now: Now) -> SerialPort:
    target = import_module("sim_doubles.benches.singles").ON_PORT[chip.name](now)
    double: SerialPort = import_module("sim_doubles.serial_line").SerialLineDouble(
        "double", now, target
    )
    return double
