"""Bus load of a board's devices, from what each of them repeats."""

from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from firmware_runtime.board.settings import BusSettings
from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction
from firmware_runtime.hal.i2c import Message


class Recurring(Struct, frozen=True):
    """Transactions that a device repeats for as long as the robot runs."""

    bus: str
    what: str
    """The words for people, such as `sonar ranging`."""
    traffic: Sequence[tuple[Message, ...]]
    period: int
    """Ns from one time to the next."""


def bus_loads(
    buses: Mapping[str, BusSettings], recurring: Iterable[Recurring]
) -> dict[str, BusLoad]:
    """The load of every bus, those on which nothing recurs included."""
    asked: dict[str, list[PeriodicTransaction]] = {name: [] for name in buses}
    for each in recurring:
        asked[each.bus] += (
            PeriodicTransaction(each.what, transaction, each.period) for transaction in each.traffic
        )
    return {
        name: BusLoad(name, round(bus.speed_hz), asked[name], bus.overhead_ns)
        for name, bus in buses.items()
    }
