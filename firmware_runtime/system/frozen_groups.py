"""How often this process's control group was frozen, or let go on (version 2).

`systemctl freeze`, `docker pause` and `cgroup.freeze` halt a process without a signal, and no
counter of the thread says so. But a poll of `cgroup.events` returns whenever the group, or one
above it, has frozen or goes on. Reading the file ends that, until the next change.

Source: Linux Documentation/admin-guide/cgroup-v2.rst (cgroup.freeze, cgroup.events).
"""

import os
from contextlib import suppress
from pathlib import PurePosixPath
from select import POLLPRI, poll

from firmware_runtime.system.files import SystemFiles
from firmware_runtime.system.throttled_groups import group_mounts

_LONGEST = 256


class FrozenGroups:
    """`times` counts from when this was made; None where there is no such file."""

    def __init__(self, files: SystemFiles) -> None:
        self._files = files
        self._times = 0
        self._events: int | None = None
        self._poller = poll()
        self.follow()

    def follow(self) -> None:
        """Watch the group that the process is in now."""
        self.close()
        name = _events_file(self._files)
        if name is not None:
            with suppress(OSError):
                self._events = os.open(self._files.path(name), os.O_RDONLY | os.O_CLOEXEC)
                os.pread(self._events, _LONGEST, 0)
                self._poller.register(self._events, POLLPRI)

    @property
    def times(self) -> int | None:
        """How often it was seen that the group froze or went on, or both since the last look."""
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


def _events_file(files: SystemFiles) -> str | None:
    """That of the process's own group; one above it that freezes shows there, too."""
    mount = group_mounts(files).get("cgroup2")
    for line in files.lines("/proc/self/cgroup"):
        if mount is not None and line.startswith("0::"):
            return str(PurePosixPath(mount) / line[3:].lstrip("/") / "cgroup.events")
    return None
