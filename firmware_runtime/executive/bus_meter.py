"""A bus's counters, copied into the statistics file, and what each device took of a step."""

from collections.abc import Iterator, Mapping
from itertools import islice
from struct import Struct
from typing import Protocol

from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import BUS, DEVICES, Layout

_COUNTERS = Struct(f"{len(BUS)}q")


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


class BusMeter:
    """Reads one bus after every step."""

    def __init__(self, bus: Bus, cells: Cells, layout: Layout, index: int) -> None:
        first = layout.bus(index)
        self._bus = bus
        self._block = cells[first : first + len(BUS)].cast("B")
        self._spent = [0] * DEVICES
        self._before = [0] * DEVICES
        self.read()  # what went over the bus before the run is in no step

    def read(self) -> None:
        """Copy the counters, and note what each device took since the last reading."""
        bus, spent, before = self._bus, self._spent, self._before
        _COUNTERS.pack_into(
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

    def spent(self) -> Iterator[tuple[int, int]]:
        """Each device with a place, by address, and the time it took in the last step, ns."""
        return zip(self._bus.by_address, self._spent, strict=False)

    def devices(self) -> list[int]:
        """Addresses of the devices with a place, then the time each took, as laid out."""
        addresses = list(islice(self._bus.by_address, DEVICES))
        return addresses + [0] * (DEVICES - len(addresses)) + self._spent
