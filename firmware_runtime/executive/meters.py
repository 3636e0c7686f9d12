"""What lines count themselves, copied into the statistics file, and what each device took."""

from collections.abc import Mapping
from itertools import islice
from struct import Struct
from typing import Protocol

from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import BUS, DEVICES, SERIAL, Layout

_OF_BUS = Struct(f"{len(BUS)}q")
_OF_PORT = Struct(f"{len(SERIAL)}q")


class Device(Protocol):
    """The time one device has had a bus for, in ns."""

    @property
    def busy_ns(self) -> int:
        """Grows only."""


class Bus(Device, Protocol):
    """What is read of a bus; `hal.accounted_bus.AccountedBus` has it."""

    name: str
    transactions: int
    bytes: int
    errors: int
    retries: int

    @property
    def by_address(self) -> Mapping[int, Device]:
        """The same by device; a device joins when it is first spoken to."""


class Port(Protocol):
    """What is read of a serial port; `hal.accounted_port.AccountedPort` has it."""

    name: str
    writes: int
    bytes_written: int
    bytes_read: int
    errors: int
    writing_ns: int
    reading_ns: int


class BusMeter:
    """Reads one bus after every step."""

    def __init__(self, bus: Bus, cells: Cells, layout: Layout, index: int) -> None:
        first = layout.bus(index)
        self._bus = bus
        self._block = cells[first : first + len(BUS)].cast("B")
        self.spent = [0] * DEVICES
        """The time each device with a place took in the last step, ns."""
        self._before = [0] * DEVICES
        self.read()  # what went over the bus before the run is in no step

    def read(self) -> None:
        """Copy the counters, and note what each device took since the last reading."""
        bus, spent, before = self._bus, self.spent, self._before
        _OF_BUS.pack_into(
            self._block, 0, bus.transactions, bus.bytes, bus.errors, bus.retries, bus.busy_ns
        )
        for index, device in enumerate(islice(bus.by_address.values(), DEVICES)):
            busy = device.busy_ns
            spent[index] = busy - before[index]
            before[index] = busy

    @property
    def busy_ns(self) -> int:
        """Time on the wire so far."""
        return self._bus.busy_ns

    @property
    def retries(self) -> int:
        """Attempts made again so far."""
        return self._bus.retries

    def addresses(self) -> list[int]:
        """Those of the devices with a place, filled up with zeros."""
        found = list(islice(self._bus.by_address, DEVICES))
        return found + [0] * (DEVICES - len(found))


class PortMeter:
    """Reads one serial port after every step."""

    def __init__(self, port: Port, cells: Cells, layout: Layout, index: int) -> None:
        first = layout.port(index)
        self._port = port
        self._block = cells[first : first + len(SERIAL)].cast("B")
        self.read()  # what went over the port before the run is in it, too

    def read(self) -> None:
        """Copy the counters."""
        port = self._port
        _OF_PORT.pack_into(
            self._block,
            0,
            port.writes,
            port.bytes_written,
            port.bytes_read,
            port.errors,
            port.writing_ns,
            port.reading_ns,
        )
