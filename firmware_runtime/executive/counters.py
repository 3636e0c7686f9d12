"""What lines, deadlines, faults and the inbox count themselves, copied into the statistics file."""

from firmware_runtime.executive.bus_meter import BusMeter
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.executive.port_meter import PortMeter
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import INPUTS_DROPPED


class Counters:
    """What others count, copied into the file: after every step, where steps take time."""

    def __init__(self, file: StatisticsFile, profiler: Profiler, inbox: Inbox) -> None:
        cells, layout = file.cells, file.layout
        self.meters = [
            BusMeter(bus, cells, layout, index) for index, bus in enumerate(profiler.buses)
        ]
        self._port_meters = [
            PortMeter(port, cells, layout, index) for index, port in enumerate(profiler.ports)
        ]
        self._cells = cells
        self._inbox = inbox
        self._faults = profiler.faults
        self._watches = [
            (layout.deadline(index), watch) for index, watch in enumerate(profiler.watches)
        ]
        self._faults.count_in(cells, layout)

    def read(self) -> None:
        """Copy them."""
        cells = self._cells
        if self._faults.pending:
            self._faults.write()
        cells[INPUTS_DROPPED] = self._inbox.dropped
        for meter in self.meters:
            meter.read()
        for port_meter in self._port_meters:
            port_meter.read()
        for first, watch in self._watches:
            cells[first] = watch.misses
            cells[first + 1] = watch.samples
            cells[first + 2] = watch.answers

    def end(self) -> None:
        """Copy them for the last time: what is not answered will not be."""
        for _, watch in self._watches:
            watch.end()
        self.read()
