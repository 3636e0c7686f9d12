"""The bus double on the wire: order, acknowledges, collisions, counters, and each adapter's errno."""

import errno
from collections.abc import Callable, Sequence
from typing import Protocol

import pytest

from firmware_runtime.hal.errors import BusFault, BusTimeout, HalError, NoAcknowledge, PortClosed
from firmware_runtime.hal.i2c import Message
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble, Target


class SeesWire(Protocol):
    """What the tests look at in a recorder."""

    seen: list[str]

    def start(self, address: int, *, read: bool) -> bool: ...
    def write(self, byte: int) -> bool: ...
    def read(self) -> int: ...
    def stop(self) -> None: ...
    def power_cycle(self) -> None: ...
