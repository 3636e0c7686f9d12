"""The machine a run takes place on: without it the run's numbers mean nothing to others."""

import os
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from firmware_runtime.system.calling_process import memory_lock_limit
from firmware_runtime.system.files import THIS_MACHINE, SystemFiles
from firmware_runtime.system.kernel import clock_source, preemption, realtime_throttling
from firmware_runtime.system.processors import (
    CPUS,
    computer_model,
    isolated,
    tickless,
    virtualised,
)

PACKAGES = ("firmware-runtime", "numpy", "smbus2", "pyserial", "msgspec")
_CLASSES = {
    os.SCHED_OTHER: "SCHED_OTHER",
    os.SCHED_FIFO: "SCHED_FIFO",
    os.SCHED_RR: "SCHED_RR",
    os.SCHED_BATCH: "SCHED_BATCH",
    os.SCHED_IDLE: "SCHED_IDLE",
}


def system_conditions(files: SystemFiles = THIS_MACHINE) -> dict[str, Any]:
    """Kernel, Python, machine and the scheduling really in force; null for what is not shown."""
    return {
        **_kernel(files),
        **_processors(files),
        "scheduler": _CLASSES.get(os.sched_getscheduler(0), "unknown"),
        "scheduler_priority": os.sched_getparam(0).sched_priority,
        "memory_lock_limit_bytes": memory_lock_limit(files),
        "python": _python(),
        "versions": _versions(),
    }


def versions_here() -> dict[str, str | None]:
    """Of Python, kernel and packages, by name, as a recording keeps them."""
    return {"python": _python(), "kernel": _kernel_name(), **_versions()}


def _python() -> str:
    return f"{platform.python_implementation()} {platform.python_version()}"


def _kernel_name() -> str:
    return f"{platform.system()} {platform.release()}"


def _kernel(files: SystemFiles) -> dict[str, Any]:
    throttling = realtime_throttling(files)
    return {
        "kernel": _kernel_name(),
        "kernel_build": platform.version(),
        "preemption": preemption(files, platform.version()),
        "clock_source": clock_source(files),
        "rt_runtime_us": throttling.runtime_us,
        "rt_period_us": throttling.period_us,
    }


def _processors(files: SystemFiles) -> dict[str, Any]:
    return {
        "machine": platform.machine(),
        "model": computer_model(files),
        "virtualised": virtualised(files),
        "cpu_count": os.cpu_count(),
        "cpus_allowed": sorted(os.sched_getaffinity(0)),
        "cpus_isolated": isolated(files),
        "cpus_tickless": tickless(files),
        "governor": files.text(f"{CPUS}/cpu0/cpufreq/scaling_governor"),
    }


@cache
def _versions() -> dict[str, str | None]:
    """What is installed; looked up once, for a process that has many runs."""
    return {name: version_of(name) for name in PACKAGES}


def version_of(package: str) -> str | None:
    """The version of a package that is installed here; None if it is not."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
