"""Counters of the machine and of control groups, beside those of the thread (`thread_counters`).

Sources: Linux Documentation/admin-guide/iostats.rst, admin-guide/cgroup-v2.rst (cpu.stat,
cgroup.freeze, cgroup.events), scheduler/sched-bwc.rst; Raspberry Pi documentation, `vcgencmd
get_throttled`, bits 0 to 3; hwmon driver rpi_volt.
"""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import suppress
from pathlib import PurePosixPath
from select import POLLPRI, poll
from types import FrameType

from firmware_runtime.system.kernel_files import SystemFiles

DISKS = "/proc/diskstats"
UNDER_VOLTAGE, CAPPED, THROTTLED, TOO_HOT = 1, 2, 4, 8
_NAME = 2
_TIMES = (6, 10, 17, 19)
"""Fields, from 0: ms of reads, writes, discards (from Linux 4.18 on) and flushes (5.5)."""
_MILLISECOND = 1_000_000
_FLAGS = "/sys/devices/platform/soc*/*firmware/get_throttled"
_ALARMS = "/sys/class/hwmon/hwmon*/in0_lcrit_alarm"
_LONGEST = 256


def disks_ns(before: bytes | None, after: bytes | None) -> int | None:
    """Time that requests to the busiest disk took between two readings of `DISKS`, in ns.

    The kernel counts ms of all requests of a disk together: a thread that was asleep has not waited
    for a disk if none did anything. None without a disk, or with the counting switched off.
    """
    earlier, later = _disk_times(before), _disk_times(after)
    if not any(later.values()):
        return None
    return max([ms - earlier.get(name, ms) for name, ms in later.items()]) * _MILLISECOND


def _disk_times(content: bytes | None) -> dict[bytes, int]:
    """Return the ms of each disk and partition, by name."""
    found: dict[bytes, int] = {}
    for line in (content or b"").splitlines():
        row = line.split()
        if len(row) > _TIMES[1]:
            ms = 0
            for at in _TIMES:  # in one frame: a machine has many disks
                if at < len(row) and row[at].isdigit():
                    ms += int(row[at])
            found[row[_NAME]] = ms
    return found


def own_groups(files: SystemFiles) -> Iterator[tuple[str, PurePosixPath]]:
    """Control groups of this process: where its hierarchy is mounted, and the group in there.

    That of version 2, and that of the controller `cpu` in version 1, as far as they are mounted.
    """
    mounts: dict[str, str] = {}
    for line in files.lines("/proc/self/mounts"):
        _, place, kind, options, *_ = [*line.split(), "", "", "", ""]
        if kind == "cgroup2" or (kind == "cgroup" and "cpu" in options.split(",")):
            mounts.setdefault(kind, place)
    for line in files.lines("/proc/self/cgroup"):
        _, controllers, group = line.split(":", maxsplit=2)
        mount = mounts.get("cgroup" if controllers else "cgroup2")
        if mount is not None and (not controllers or "cpu" in controllers.split(",")):
            yield mount, PurePosixPath(mount) / group.lstrip("/")


def throttled_files(files: SystemFiles) -> list[str]:
    """Return the files `cpu.stat` of this process's groups that state how long they were throttled.

    A group with a quota (`cpu.max`, or `cpu.cfs_quota_us` in version 1) is held back once its
    processes have used it up, with everything below it: groups above count as well. Ordinary
    processes only: the real-time classes know no quota of this kind.
    """
    found = [
        f"{each}/cpu.stat"
        for mount, group in own_groups(files)
        for each in (group, *group.parents)
        if each.is_relative_to(mount)
    ]
    return [name for name in found if throttled_ns(files.content(name)) is not None]


def throttled_ns(content: bytes | None) -> int | None:
    """Time in a file `cpu.stat`, in ns; None for one without it."""
    us = _stated(content, b"throttled_usec")
    return _stated(content, b"throttled_time") if us is None else us * 1000


def throttlings(content: bytes | None) -> int | None:
    """Periods of its quota in which a group had used it up; None where `cpu.stat` has no count."""
    return _stated(content, b"nr_throttled")


def _stated(content: bytes | None, name: bytes) -> int | None:
    for line in (content or b"").splitlines():
        key, _, value = line.partition(b" ")
        if key == name and value.isdigit():
            return int(value)
    return None


class FrozenGroups:
    """Changes of this process's control group (version 2) between frozen and thawed.

    `systemctl freeze`, `docker pause` and `cgroup.freeze` halt a process without a signal, and no
    counter of the thread shows it. But a poll of `cgroup.events` returns whenever the group, or one
    above it, freezes or thaws. Reading the file ends that, until the next change.
    """

    def __init__(self, files: SystemFiles) -> None:
        self._files = files
        self._times = 0
        self._events: int | None = None
        self._poller = poll()
        self.follow()

    def follow(self) -> None:
        """Watch the group that the process is in now."""
        self.close()
        groups = [group for _, group in own_groups(self._files)]
        for group in groups:
            with suppress(OSError):  # version 1 has no such file
                name = self._files.path(f"{group}/cgroup.events")
                self._events = os.open(name, os.O_RDONLY | os.O_CLOEXEC)
                os.pread(self._events, _LONGEST, 0)
                self._poller.register(self._events, POLLPRI)

    @property
    def times(self) -> int | None:
        """Polls since the construction that saw a change; None where there is no such file."""
        if self._events is None:
            return None
        if any(came & POLLPRI for _, came in self._poller.poll(0)):
            self._times += 1
            with suppress(OSError):  # the group is gone, and the process in another one
                os.pread(self._events, _LONGEST, 0)
        return self._times

    def close(self) -> None:
        """Close the file."""
        if self._events is not None:
            with suppress(KeyError):
                self._poller.unregister(self._events)
            os.close(self._events)
            self._events = None


class Supply:
    """Supply and heat as a Raspberry Pi's firmware shows them: under-voltage, clock held down.

    Asking the firmware takes longer than any counter (a mailbox): call it only where it could
    explain something.
    """

    def __init__(self, files: SystemFiles) -> None:
        self._files = files
        self._flags = next(iter(files.matching(_FLAGS)), None)
        alarms = files.matching(_ALARMS)
        names = [files.text(f"{each.rpartition('/')[0]}/name") for each in alarms]
        monitors = (each for each, name in zip(alarms, names, strict=True) if name == "rpi_volt")
        self._alarm = next(monitors, None)

    def __call__(self) -> int | None:
        """Return the bits that are set now; None where nothing is shown."""
        if self._flags is not None:
            try:
                return int(self._files.text(self._flags) or "", 16) & 0xF
            except ValueError:
                return None
        alarm = None if self._alarm is None else self._files.integer(self._alarm)
        return None if alarm is None else UNDER_VOLTAGE * (alarm != 0)


class Continued:
    """Count of this process's continuations after a stop (SIGSTOP, Ctrl-Z, a debugger).

    A stopped process neither runs nor waits for a processor, and no counter of the kernel shows it.
    But SIGCONT comes when it goes on, and handling it changes nothing else. `times` counts from
    `watch` on; None while it cannot be known.
    """

    def __init__(self) -> None:
        self.times: int | None = None

    def watch(self) -> None:
        """Count from now on; only the main thread may handle signals, elsewhere nothing changes.

        Another handler that is already there stays, and nothing is counted.
        """
        if threading.current_thread() is not threading.main_thread() or self.times is not None:
            return
        if signal.getsignal(signal.SIGCONT) is signal.SIG_DFL:
            self.times = 0
            signal.signal(signal.SIGCONT, self._note)

    def unwatch(self) -> None:
        """Leave the signal as it was."""
        if self.times is not None:
            self.times = None
            signal.signal(signal.SIGCONT, signal.SIG_DFL)

    def _note(self, _number: int, _frame: FrameType | None) -> None:
        if self.times is not None:
            self.times += 1


CONTINUED = Continued()
