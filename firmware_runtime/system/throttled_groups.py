"""The control groups that can hold this process back, and for how long they have.

A group with a quota (`cpu.max`, or `cpu.cfs_quota_us` in version 1) is throttled when its processes
have used it up, with everything below it. So the files of the own group and of all above it count.
Ordinary processes only: the real-time classes know no quota of this kind.

Source: Linux Documentation/admin-guide/cgroup-v2.rst (cpu.stat), scheduler/sched-bwc.rst.
"""

from pathlib import PurePosixPath

from firmware_runtime.system.files import SystemFiles

_MICROSECOND = 1000


def throttled_files(files: SystemFiles) -> list[str]:
    """The files `cpu.stat` of this process's groups that say how long they were throttled."""
    mounts = group_mounts(files)
    found = []
    for line in files.lines("/proc/self/cgroup"):
        _, _, rest = line.partition(":")
        controllers, _, group = rest.partition(":")
        mount = mounts.get("cgroup2" if controllers == "" else "cpu")
        if mount is not None and (controllers == "" or "cpu" in controllers.split(",")):
            inside = PurePosixPath(mount) / group.lstrip("/")
            levels = (inside, *inside.parents)
            found += [f"{each}/cpu.stat" for each in levels if each.is_relative_to(mount)]
    return [name for name in found if throttled_ns(files.content(name)) is not None]


def throttled_ns(content: bytes | None) -> int | None:
    """The time in a file `cpu.stat`, ns; None for one without it."""
    for line in (content or b"").splitlines():
        name, _, value = line.partition(b" ")
        if name == b"throttled_usec" and value.isdigit():
            return int(value) * _MICROSECOND
        if name == b"throttled_time" and value.isdigit():
            return int(value)
    return None


def throttlings(content: bytes | None) -> int | None:
    """In how many periods of its quota the group had used it up; None where that is not said."""
    for line in (content or b"").splitlines():
        name, _, value = line.partition(b" ")
        if name == b"nr_throttled" and value.isdigit():
            return int(value)
    return None


def group_mounts(files: SystemFiles) -> dict[str, str]:
    """Where the groups of version 2 are mounted, and those of the controller `cpu`."""
    found: dict[str, str] = {}
    for line in files.lines("/proc/self/mounts"):
        words = line.split()
        if len(words) < 4:
            continue
        _, place, kind, options = words[:4]
        if kind == "cgroup2":
            found.setdefault("cgroup2", place)
        elif kind == "cgroup" and "cpu" in options.split(","):
            found.setdefault("cpu", place)
    return found
