"""The buses and ports of this machine, on demand: a robot on doubles loads no adapter's library.

What each function does, and what it raises, is said where it is defined: `linux`, `linux_serial`.
"""

from importlib import import_module

from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort

_HERE = "firmware_runtime.hal"


def open_i2c(name: str, device: str, *, alone: bool) -> I2cBus:
    """Open a bus by the path of its device node."""
    bus: I2cBus = import_module(f"{_HERE}.linux").open_i2c(name, device, alone=alone)
    return bus


def open_serial(name: str, device: str, baud: int, *, alone: bool) -> SerialPort:
    """Open a port by the path of its device node."""
    module = import_module(f"{_HERE}.linux_serial")
    port: SerialPort = module.open_serial(name, device, baud, alone=alone)
    return port


def check_node(name: str, device: str) -> None:
    """Raise BusAbsent unless this process may open the device node."""
    import_module(f"{_HERE}.linux").check_node(name, device)
