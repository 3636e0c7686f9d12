"""The conditions a run takes place under: without them its numbers mean nothing to anybody else."""

import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

PACKAGES = ("firmware-runtime", "numpy", "smbus2", "pyserial", "msgspec")
_CPU = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")
_CLOCK_SOURCE = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
_CLASSES = {
    os.SCHED_OTHER: "SCHED_OTHER",
    os.SCHED_FIFO: "SCHED_FIFO",
    os.SCHED_RR: "SCHED_RR",
    os.SCHED_BATCH: "SCHED_BATCH",
    os.SCHED_IDLE: "SCHED_IDLE",
}


def system_conditions() -> dict[str, Any]:
    """Kernel, Python, machine and the scheduling really in force; null for what is not shown."""
    return {
        "kernel": f"{platform.system()} {platform.release()}",
        "kernel_build": platform.version(),
        "machine": platform.machine(),
        "model": _text(Path("/proc/device-tree/model")),
        "virtualised": _virtualised(),
        "cpu_count": os.cpu_count(),
        "cpus_allowed": sorted(os.sched_getaffinity(0)),
        "governor": _text(_CPU),
        "clock_source": _text(_CLOCK_SOURCE),
        "scheduler": _CLASSES.get(os.sched_getscheduler(0), "unknown"),
        "scheduler_priority": os.sched_getparam(0).sched_priority,
        "python": f"{platform.python_implementation()} {platform.python_version()}",
        "versions": {name: _version(name) for name in PACKAGES},
    }


def _text(path: Path) -> str | None:
    """A one-line file of the kernel's, if there is one and it may be read."""
    try:
        return path.read_text().strip("\0\n ")
    except OSError:
        return None


def _virtualised() -> bool | None:
    """Whether a hypervisor is underneath; None where nothing tells."""
    if Path("/proc/device-tree/hypervisor").exists() or Path("/sys/hypervisor/type").exists():
        return True
    information = _text(Path("/proc/cpuinfo"))
    if information is None or "flags" not in information:
        return None  # on Arm, /proc/cpuinfo does not say
    return " hypervisor" in information


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
