"""A serial port's counters, copied into the statistics file."""

from struct import Struct
from typing import Protocol

from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import SERIAL, Layout

_COUNTERS = Struct(f"{len(SERIAL)}q")


class Port(Protocol):
    """What is read of a serial port; `hal.accounted_port.AccountedPort` has it."""

    name: str
    writes: int
    bytes_written: int
    bytes_read: int
    errors: int
    writing_ns: int
    reading_ns: int


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
        _COUNTERS.pack_into(
            self._block,
            0,
            port.writes,
            port.bytes_written,
            port.bytes_read,
            port.errors,
            port.writing_ns,
            port.reading_ns,
        )
