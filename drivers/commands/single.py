"""The one bus or port that a chip which is tried out hangs on: a real one, or its double's.

What makes doubles is imported only when they are asked for.
"""

import argparse
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from importlib import import_module
from pathlib import Path
from time import monotonic_ns
from typing import Final, NamedTuple, Protocol, TypeAlias

from drivers.catalogue.trial import Actuator, OnBus, OnPort, Sensor, Triable
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.line_time import WireClock
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.retry import THREE_ATTEMPTS
from firmware_runtime.hal.serial import SerialPort

BUS: Final = "/dev/i2c-1"
"""The bus on the pin header of every Raspberry Pi."""
PORT: Final = "/dev/serial0"
BUS_HZ: Final = 400_000

Now: TypeAlias = Callable[[], int]


class DoublesClock(WireClock, Protocol):
    """The real time that a double lives in."""

    def look(self) -> int:
        """Read the clock; return the present instant, in ns."""


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
    clock = _clock() if arguments.doubles else None
    now: Now = monotonic_ns if clock is None else clock.look
    if isinstance(chip, OnBus):
        address: int = arguments.address
        bus = _bus(arguments) if clock is None else _bus_double(chip, address, clock)
        with closing(AccountedBus(bus, BUS_HZ, THREE_ATTEMPTS)) as line:
            yield Single(chip.build(line, address, vars(arguments)), now)
    else:
        port = _port(chip, arguments) if clock is None else _port_double(chip, clock)
        with closing(port):
            yield Single(chip.build(port, vars(arguments)), now)


def _bus(arguments: argparse.Namespace) -> I2cBus:
    device = device_of(arguments.bus)
    return open_i2c(Path(device).name, device, alone=True)


def _port(chip: OnPort, arguments: argparse.Namespace) -> SerialPort:
    return open_serial(Path(arguments.port).name, arguments.port, chip.baud)


# Doubles -----------------------------------------------------------------------------------------


def _clock() -> DoublesClock:
    clock: DoublesClock = import_module("sim_doubles.served.server").RealClock()
    return clock


def _bus_double(chip: OnBus, address: int, clock: DoublesClock) -> I2cBus:
    targets = import_module("sim_doubles.rigs.singles").ON_BUS[chip.name](clock, address)
    double: I2cBus = import_module("sim_doubles.i2c_bus").I2cBusDouble(
        "double", clock, targets, bus_hz=BUS_HZ, reach=clock.reach
    )
    return double


def _port_double(chip: OnPort, clock: DoublesClock) -> SerialPort:
    target = import_module("sim_doubles.rigs.singles").ON_PORT[chip.name](clock)
    double: SerialPort = import_module("sim_doubles.serial_line").SerialLineDouble(
        "double", clock, target
    )
    return double
