from types import SimpleNamespace
from typing import Any

from firmware_runtime.executive.meters import BusMeter
from firmware_runtime.statistics.histogram import empty_cells
from firmware_runtime.statistics.layout import DEVICES, Layout

LAYOUT = Layout(buses=("i2c1",))


def bus(*busy_ns: int) -> Any:  # noqa: ANN401 -- stands in for any bus
    devices = {0x40 + index: SimpleNamespace(busy_ns=busy) for index, busy in enumerate(busy_ns)}
    return SimpleNamespace(
        name="i2c1",
        transactions=3,
        bytes=70,
        errors=2,
        retries=1,
        busy_ns=sum(busy_ns),
        by_address=devices,
    )


def test_counters_are_copied_as_they_are() -> None:
    cells = empty_cells(LAYOUT.cells)
    BusMeter(bus(500, 900), cells, LAYOUT, 0).read()
    assert list(cells[LAYOUT.bus(0) : LAYOUT.bus(0) + 5]) == [3, 70, 2, 1, 1400]


def test_a_device_is_charged_what_it_took_since_the_last_reading() -> None:
    i2c = bus(500, 900)
    meter = BusMeter(i2c, empty_cells(LAYOUT.cells), LAYOUT, 0)
    i2c.by_address[0x41].busy_ns += 70
    meter.read()
    assert (meter.addresses(), meter.spent) == ([0x40, 0x41] + [0] * 6, [0, 70] + [0] * 6)


def test_a_ninth_device_has_no_place_of_its_own() -> None:
    meter = BusMeter(bus(*range(1, 12)), empty_cells(LAYOUT.cells), LAYOUT, 0)
    meter.read()
    assert len(meter.addresses()) == len(meter.spent) == DEVICES
