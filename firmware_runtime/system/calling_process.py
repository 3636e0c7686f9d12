"""What the calling process may do: its limits, its capabilities, its control group.

Sources: proc(5), getrlimit(2), capabilities(7), cgroups(7).
"""

import re

from firmware_runtime.system.files import SystemFiles

UNLIMITED = "unlimited"
CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23


def limit(files: SystemFiles, name: str) -> int | str | None:
    """A soft limit by its name in /proc/self/limits: a number, `unlimited`, None if not shown."""
    for line in files.lines("/proc/self/limits"):
        if line.startswith(name):
            soft = line[len(name) :].split()[0]
            return soft if soft == UNLIMITED else int(soft)
    return None


def realtime_priority_limit(files: SystemFiles) -> int | str | None:
    """The highest real-time priority this process may take without CAP_SYS_NICE."""
    return limit(files, "Max realtime priority")


def memory_lock_limit(files: SystemFiles) -> int | str | None:
    """How many bytes this process may keep in RAM without CAP_IPC_LOCK."""
    return limit(files, "Max locked memory")


def has_capability(files: SystemFiles, number: int) -> bool:
    """Whether a capability is in effect."""
    return bool(int(status(files, "CapEff") or "0", 16) >> number & 1)


def status(files: SystemFiles, field: str) -> str | None:
    """One field of /proc/self/status."""
    for line in files.lines("/proc/self/status"):
        name, _, value = line.partition(":")
        if name == field:
            return value.strip()
    return None


def cpu_group_file(files: SystemFiles, name: str) -> str | None:
    """The path of a file of this process's group under the first version's `cpu` controller."""
    for line in files.lines("/proc/self/cgroup"):
        _number, controllers, group = line.split(":", maxsplit=2)
        if "cpu" not in controllers.split(","):
            continue
        for mounted in (controllers, "cpu"):
            path = re.sub("/+", "/", f"/sys/fs/cgroup/{mounted}/{group}/{name}")
            if files.exists(path):
                return path
    return None
