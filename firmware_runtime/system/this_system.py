"""The operating system: what Linux alone has is refused here, elsewhere, in a sentence.

On macOS work: simulation and runs in real time on doubles of their own process, recordings and all
that is made of them, tests and pages. Linux alone has what reaches chips, and what other processes
reach a run by: its I2C, serial and GPIO devices, sockets of packets that say who sends, descriptors
of processes, SCHED_FIFO, systemd.
"""

import os
import sys
from typing import Final

from firmware_runtime.errors import ConfigError

IS_LINUX: Final = sys.platform == "linux"
NAME: Final = {"Darwin": "macOS"}.get(os.uname().sysname, os.uname().sysname)
_EXPECTED: Final = "Linux (simulation, doubles of the same process, replay and pages work here)"


def demand_linux(what: str) -> None:
    """Raise ConfigError on another system, for what needs Linux."""
    if not IS_LINUX:
        raise ConfigError.of_one(what, f"{NAME} lacks what this needs", _EXPECTED)


def allowed_cpus() -> set[int]:
    """The processors that this process may use; all of them where that cannot be restricted."""
    if IS_LINUX:
        return os.sched_getaffinity(0)
    return set(range(os.cpu_count() or 1))


def sync_content(descriptor: int) -> None:
    """Wait until the disk has what was written to a file. Raises OSError."""
    if IS_LINUX:
        os.fdatasync(descriptor)
    else:
        os.fsync(descriptor)


def take_space(descriptor: int, first: int, size: int) -> None:
    """Let a file have the space of so many bytes from one on, which stay as they are.

    Raises OSError where there is no room for them.
    """
    if IS_LINUX:
        os.posix_fallocate(descriptor, first, size)
    else:
        os.pwrite(descriptor, os.pread(descriptor, size, first).ljust(size, b"\0"), first)
