"""How the kernel was built and set: preemption, real-time throttling, clock source.

Sources: Linux Documentation/scheduler/sched-rt-group.rst, kernel/sched/debug.c (file `preempt`),
init/Makefile (the words of the version), proc(5).
"""

import re

from msgspec import Struct

from firmware_runtime.system.files import SystemFiles

_CLOCK_SOURCES = "/sys/devices/system/clocksource/clocksource0"
_CHOSEN = r"\((\w+)\)"
_AT_BOOT = r"(?:^|\s)preempt=(\w+)"


class RealtimeThrottling(Struct, frozen=True):
    """Processor time that real-time classes may take of every period; runtime -1 is all of it."""

    runtime_us: int | None
    period_us: int | None


def realtime_throttling(files: SystemFiles) -> RealtimeThrottling:
    """The limit of the whole machine."""
    return RealtimeThrottling(
        files.integer("/proc/sys/kernel/sched_rt_runtime_us"),
        files.integer("/proc/sys/kernel/sched_rt_period_us"),
    )


def preemption(files: SystemFiles, kernel_build: str) -> str | None:
    """How readily the kernel lets a waiting thread in; None for a version that does not say.

    `rt` (PREEMPT_RT) or `full`; `none or voluntary` where the version names no model. Where it is
    chosen at boot, what was chosen (`full`, `lazy`, `voluntary`, `none`), or `dynamic` if that is
    not shown.
    """
    words = kernel_build.replace("+", " ").split()
    if files.text("/sys/kernel/realtime") == "1" or "PREEMPT_RT" in words:
        return "rt"
    if "PREEMPT_DYNAMIC" in words:
        return _chosen(files) or "dynamic"
    if "PREEMPT" in words:
        return "full"
    return "none or voluntary" if kernel_build.startswith("#") else None


def _chosen(files: SystemFiles) -> str | None:
    """What debugfs shows in parentheses, or the kernel's command line."""
    shown = re.search(_CHOSEN, files.text("/sys/kernel/debug/sched/preempt") or "")
    at_boot = re.search(_AT_BOOT, files.text("/proc/cmdline") or "")
    found = shown or at_boot
    return found[1] if found else None


def clock_source(files: SystemFiles) -> str | None:
    """What the kernel reads the time from."""
    return files.text(f"{_CLOCK_SOURCES}/current_clocksource")


def clock_sources(files: SystemFiles) -> list[str]:
    """All it could read the time from, the best first."""
    return (files.text(f"{_CLOCK_SOURCES}/available_clocksource") or "").split()
