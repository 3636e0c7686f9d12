"""The trolley's chips, played by this process at pseudo-terminals that the container sees."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic_ns
from typing import NamedTuple

from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.serial_pty import SerialPty

PRIORITY = 50
WALL_M = 1.5
"""As far as it stays: a trolley that is armed would drive towards it."""


class Chips(NamedTuple):
    """The nodes that the container is to see, by their names there; the motors."""

    nodes: dict[str, str]
    drive: SabertoothDouble

    @property
    def have_turned(self) -> bool:
        """Return whether a motor has ever turned."""
        return any(self.drive.motors.turned_rad(monotonic_ns()))


@contextmanager
def chips() -> Iterator[Chips]:
    """Play them until the block ends, before all ordinary work: a chip is never late."""
    drive = SabertoothDouble(monotonic_ns)
    eye = MaxbotixDouble(monotonic_ns, lambda _at: WALL_M)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    with SerialPty(drive, monotonic_ns) as drive_line, SerialPty(eye, monotonic_ns) as eye_line:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))  # threads have kept the first
        nodes = {"/dev/trolley-drive": drive_line.path, "/dev/trolley-eye": eye_line.path}
        for node in nodes.values():
            Path(node).chmod(0o666)
        yield Chips(nodes, drive)
