"""Keeps the memories at TachoBot's addresses as its doubles are, until it is ended."""

import sys
from time import monotonic_ns

from firmware_runtime.board import registry
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import HalError
from sim_doubles.clock import ManualClock
from sim_doubles.register_ram import Puppet
from sim_doubles.rigs.tachobot import TachobotRig
from tests.pi.guest.emulated import BUS, READY


def main() -> None:
    """Leave in READY how often it has looked, and how long that took."""
    clock = ManualClock(monotonic_ns())  # a look is one instant for all doubles
    rig = TachobotRig(registry.load(sys.argv[1]).settings, clock)
    rig.imu.reset_time = 0  # it learns of a reset late, and the host has waited by then
    memories = open_i2c("memories", BUS, timeout_ms=1000)
    puppet = Puppet(memories, rig.buses["i2c1"], (rig.thrust, rig.imu))
    looks, began_at = 0, monotonic_ns()
    while True:
        clock.reach(monotonic_ns())
        try:
            puppet.step()
        except HalError as error:  # a chip outlives an error of its bus
            print(error, flush=True)  # noqa: T201 -- its log
        looks += 1
        if looks % 50 == 1:
            READY.write_text(f"{looks} {(monotonic_ns() - began_at) / looks / 1e6:.1f}")


if __name__ == "__main__":
    main()
