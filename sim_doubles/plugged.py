"""Buses of doubles behind device nodes: `/dev/i2c-1`, or any other path.

    with plug(1, [Pca9685Double(monotonic_ns)]) as bus:
        SMBus(1).write_byte_data(0x40, 0x00, 0x20)

`sim_doubles.smbus` and `sim_doubles.busio` look a bus up at every use. So an `SMBus` that a module
opened when it was imported goes on with whatever is plugged in at its path later, and finds no
device (ENODEV) where nothing is. A real adapter must be opened again when it was pulled out.
"""

import errno
import os
from collections.abc import Iterable
from pathlib import PurePath
from time import monotonic_ns
from types import TracebackType

from sim_doubles.early import OpenBus, is_allowed
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import ADAPTERS, Target

_buses: dict[str, I2cBusDouble] = {}


class Plug:
    """A bus at its path until `unplug`, or to the end of a `with` that gives the bus."""

    def __init__(self, path: str, bus: I2cBusDouble) -> None:
        self.path = path
        self.bus = bus
        if path in _buses:
            raise ValueError(f"{path}: {_buses[path].name} is plugged in, expected a free path")
        _buses[path] = bus

    def unplug(self) -> None:
        """Take the bus away from its path; twice is harmless."""
        if _buses.get(self.path) is self.bus:
            del _buses[self.path]

    def __enter__(self) -> I2cBusDouble:
        return self.bus

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _traceback: TracebackType | None,
    ) -> None:
        self.unplug()


def plug(bus: int | str, doubles: I2cBusDouble | Iterable[Target]) -> Plug:
    """Put doubles behind a bus number, or the path of a device node, in this process.

    `doubles` are a bus, or targets, which get one in real time on which a transaction takes none.
    Raises ValueError where something is plugged in already.
    """
    path = path_of(bus)
    if not isinstance(doubles, I2cBusDouble):
        doubles = I2cBusDouble(PurePath(path).name, monotonic_ns, list(doubles))
    return Plug(path, doubles)


def path_of(bus: int | str) -> str:
    """The path that a bus number stands for; a path is one."""
    return f"/dev/i2c-{bus}" if isinstance(bus, int) else bus


def functions(path: str) -> int:
    """Open a path; return what its adapter can do, as the ioctl I2C_FUNCS.

    Raises FileNotFoundError where no bus of doubles is plugged in, except early (`early`).
    """
    if path in _buses:
        return _buses[path].adapter.functions
    if is_allowed():
        return ADAPTERS["bcm2835"].functions
    raise FileNotFoundError(
        errno.ENOENT, "no bus of doubles is plugged in here (sim_doubles.plug)", path
    )


def answers_at(descriptor: OpenBus) -> bool:
    """Return whether doubles answer there, or fail there, and no real adapter does."""
    return not descriptor.is_real or descriptor.path in _buses


def bus_at(path: str) -> I2cBusDouble:
    """The bus behind an open path. Raises OSError (ENODEV) where it was unplugged."""
    if path not in _buses:
        raise OSError(errno.ENODEV, os.strerror(errno.ENODEV), path)
    return _buses[path]
