"""Keeps the memories at TachoBot's addresses as its doubles are, until it is ended."""

import sys
from time import monotonic_ns

from firmware_runtime.board import registry
from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import HalError
from sim_doubles.register_ram import Puppet
from sim_doubles.rigs.tachobot import TachobotRig
from tests.pi.guest.emulated import BUS, READY


class RealTime:
    """The machine's own time, in which wire time has passed already."""

    def __call__(self) -> int:
        return monotonic_ns()

    def reach(self, at: int) -> None:
        """Go nowhere: a double that says how long a transfer would have taken is not waited for."""


def main() -> None:
    """Leave in READY how often it has looked, and how long that took."""
    rig = TachobotRig(registry.load(sys.argv[1]).settings, RealTime())
    rig.imu.reset_time = 0  # it learns of a reset late, and the host has waited by then
    memories = open_i2c("memories", BUS, timeout_ms=1000)
    puppet = Puppet(memories, rig.buses["i2c1"], (rig.thrust, rig.imu))
    looks, began_at = 0, monotonic_ns()
    while True:
        try:
            puppet.step()
        except HalError as error:  # a chip outlives an error of its bus
            print(error, flush=True)  # noqa: T201 -- its log
        looks += 1
        if looks % 50 == 1:
            READY.write_text(f"{looks} {(monotonic_ns() - began_at) / looks / 1e6:.1f}")


if __name__ == "__main__":
    main()
