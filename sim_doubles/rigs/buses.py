"""The buses of a rig, each as fast as its board says."""

from collections.abc import Mapping, Sequence

from firmware_runtime.board.settings import BusSettings
from firmware_runtime.hal.line_time import WireClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.i2c_target import Target


def buses_of(
    stated: Mapping[str, BusSettings], wired: Mapping[str, Sequence[Target]], clock: WireClock
) -> dict[str, I2cBusDouble]:
    """Each bus with the targets wired to it; transactions take their time on the clock."""
    now = clock.__call__  # as a method, which CPython calls sooner than an object
    return {
        name: I2cBusDouble(
            name,
            now,
            targets,
            bus_hz=round(stated[name].speed_hz),
            overhead_ns=stated[name].overhead_ns,
            reach=clock.reach,
        )
        for name, targets in wired.items()
    }
