"""The machine a run takes place on: without it the run's numbers mean nothing to others.

A timing means little without the load that other processes and the host put on the machine.

Source: proc_stat(5); ticks of all processors together.
"""

import os
import sys
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from firmware_runtime.system.kernel_files import (
    CPUS,
    THIS_MACHINE,
    SystemFiles,
    clock_source,
    computer_model,
    isolated,
    memory_lock_limit,
    preemption,
    realtime_throttling,
    tickless,
    virtualised,
)
from firmware_runtime.system.packages import version_of
from firmware_runtime.system.this_system import IS_LINUX, allowed_cpus

PACKAGES = ("firmware-runtime", "numpy", "smbus2", "pyserial", "msgspec")
_IMPLEMENTATIONS = {"cpython": "CPython", "pypy": "PyPy"}
_CLASSES = {0: "SCHED_OTHER", 1: "SCHED_FIFO", 2: "SCHED_RR", 3: "SCHED_BATCH", 5: "SCHED_IDLE"}
"""By their numbers on Linux. Source: sched_setscheduler(2), <linux/sched.h>."""


def system_conditions(files: SystemFiles = THIS_MACHINE) -> dict[str, Any]:
    """Kernel, Python, machine and the scheduling really in force; null for what is not shown."""
    return {
        **_kernel(files),
        **_processors(files),
        **_scheduling(),
        "memory_lock_limit_bytes": memory_lock_limit(files),
        "python": _python(),
        "versions": _versions(),
    }


def _scheduling() -> dict[str, object]:
    if not IS_LINUX:
        return {"scheduler": None, "scheduler_priority": None}
    return {
        "scheduler": _CLASSES.get(os.sched_getscheduler(0), "unknown"),
        "scheduler_priority": os.sched_getparam(0).sched_priority,
    }


def versions_here() -> dict[str, str | None]:
    """Return the versions of Python, kernel and packages, by name, as a recording keeps them."""
    return {"python": _python(), "kernel": _kernel_name(), **_versions()}


def _python() -> str:
    name = sys.implementation.name
    return f"{_IMPLEMENTATIONS.get(name, name)} {sys.version.split()[0]}"


def _kernel_name() -> str:
    system = os.uname()
    return f"{system.sysname} {system.release}"


def _kernel(files: SystemFiles) -> dict[str, object]:
    throttling = realtime_throttling(files)
    return {
        "kernel": _kernel_name(),
        "kernel_build": os.uname().version,
        "preemption": preemption(files, os.uname().version),
        "clock_source": clock_source(files),
        "rt_runtime_us": throttling.runtime_us,
        "rt_period_us": throttling.period_us,
    }


def _processors(files: SystemFiles) -> dict[str, object]:
    return {
        "machine": os.uname().machine,
        "model": computer_model(files),
        "virtualised": virtualised(files),
        "cpu_count": os.cpu_count(),
        "cpus_allowed": sorted(allowed_cpus()),
        "cpus_isolated": isolated(files),
        "cpus_tickless": tickless(files),
        "governor": files.text(f"{CPUS}/cpu0/cpufreq/scaling_governor"),
    }


@cache
def _versions() -> dict[str, str | None]:
    """Return what is installed; looked up once, for a process that has many runs."""
    return {name: version_of(name) for name in PACKAGES}


BUSY_SHARE, STOLEN_SHARE = 0.1, 0.01
"""Of all processors: other processes, or a host, that take more disturb a measurement."""
USER, NICE, SYSTEM, IDLE, WAITING, IRQ, SOFTIRQ, STEAL = range(8)


def first_line() -> str:
    """The sums over all processors."""
    with Path("/proc/stat").open(encoding="ascii") as lines:
        return lines.readline()


def own_ticks() -> float:
    """Processor time of this process and of the children that have ended, in ticks."""
    return sum(os.times()[:4]) * os.sysconf("SC_CLK_TCK")


class Neighbours:
    """Measures from its construction on."""

    def __init__(
        self, line: Callable[[], str] = first_line, own: Callable[[], float] = own_ticks
    ) -> None:
        self._line, self._own = line, own
        self._ticks, self._own_ticks = self._read(), own()

    def shares(self) -> Mapping[str, float]:
        """Shares of all processors: what other processes took, and what the host withheld."""
        passed = [now - before for now, before in zip(self._read(), self._ticks, strict=True)]
        everything = max(sum(passed), 1)
        busy = everything - passed[IDLE] - passed[WAITING] - passed[STEAL]
        others = max(busy - (self._own() - self._own_ticks), 0)
        return {"processes": others / everything, "host": passed[STEAL] / everything}

    def _read(self) -> list[int]:
        return [int(word) for word in self._line().split()[1:9]]


def busy(shares: Mapping[str, float]) -> list[str]:
    """Others that took enough processor time to disturb, by the shares of `Neighbours`."""
    found = []
    if shares["processes"] > BUSY_SHARE:
        found.append(f"other processes took {shares['processes']:.0%} of the processors")
    if shares["host"] > STOLEN_SHARE:
        found.append(f"the host withheld {shares['host']:.0%} of the processors")
    return found
