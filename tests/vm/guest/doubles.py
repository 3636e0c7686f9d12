"""`doubles serve --usbip`, with an inertial sensor that samples at most 50 times a second.

From power-up until a driver sets it otherwise an MPU-9250 takes 8000 samples a second. A PC's
double keeps up with that. Under emulation it would not: each answer would come later than the last.
"""

import sys

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from sim_doubles.chips import mpu9250
from sim_doubles.chips.mpu9250_registers import sample_period

WORLDS = {"tachobot": ("--set", "world.yaw_damping_nms=1.0"), "detective": ()}
"""TachoBot stands still soon after it was switched off, so that the next run can calibrate."""


def unhurried(registers: bytearray) -> int:
    """The period that the registers ask for, or longer."""
    return max(sample_period(registers), SECOND // 50)


if __name__ == "__main__":
    mpu9250.sample_period = unhurried  # type: ignore[attr-defined]
    sys.exit(main(["doubles", "serve", "--usbip", *sys.argv[1:], *WORLDS[sys.argv[1]]]))
