"""Identity, priority and processors of this process; notes that hold for one boot.

A process number alone is used again, after a restart of the machine very soon; with the moment the
process started and the boot it started in, it is not. Source: proc(5), /proc/[pid]/stat field 22.
"""

import os
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import clock_gettime_ns, monotonic_ns
from typing import Annotated, Final, TypeVar

import msgspec
from msgspec import Meta, Struct

from firmware_runtime.system.atomic_file import read_file, replace_file
from firmware_runtime.system.this_system import IS_LINUX, allowed_cpus

_BOOT_ID = Path("/proc/sys/kernel/random/boot_id")
_ENDED = -1
_SECOND: Final = 1_000_000_000
_READINGS: Final = 5
_MOST: Final = 2**22
"""The largest process number that Linux gives. Source: proc(5), /proc/sys/kernel/pid_max."""


class ProcessIdentity(Struct, frozen=True):
    """Identity of a process, as a file's header carries it."""

    pid: Annotated[int, Meta(gt=0, le=_MOST)]
    started_ticks: int | None
    """Clock ticks from boot to its start; None where the system does not show it."""
    boot_id: str


def this_process() -> ProcessIdentity:
    """The identity of the calling process."""
    pid = os.getpid()
    return ProcessIdentity(pid, _started_ticks(pid), boot_id())


def started_at() -> int:
    """Return when the calling process started, ns of CLOCK_MONOTONIC, at most a tick too early.

    Time that the machine slept since then makes it earlier still. Now, where it is not shown.
    """
    ticks = _started_ticks(os.getpid())
    if ticks is None:
        return monotonic_ns()
    return ticks * _SECOND // os.sysconf("SC_CLK_TCK") - slept(_READINGS)


_ASLEEP_TOO: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that goes on while the machine sleeps; macOS calls that one monotonic, and Python's
`monotonic_ns` stands still there too."""


def slept(readings: int = 1) -> int:
    """For how long the machine has slept since it started, ns.

    Too little, and never too much, by what passes between the readings of two clocks: the best of
    so many is taken. Source: clock_gettime(2).
    """
    return max(clock_gettime_ns(_ASLEEP_TOO) - monotonic_ns() for _ in range(readings))


def is_running(identity: ProcessIdentity) -> bool:
    """Return whether the process of that identity still exists on this machine."""
    if not is_this_boot(identity.boot_id):
        return False
    started, stated = _started_ticks(identity.pid), identity.started_ticks
    return exists(identity.pid) if None in {started, stated} else started == stated


def is_this_boot(noted: str) -> bool:
    """Return whether a boot's identity is that of the present one, as far as both are known."""
    return len({noted, boot_id()} - {""}) <= 1


def boot_id() -> str:
    """The present boot's identity; empty where a service may not see it (ProcSubset=pid)."""
    try:
        return _BOOT_ID.read_text().strip()
    except OSError:
        return ""


def _started_ticks(pid: int) -> int | None:
    """Clock ticks from boot to the process's start, -1 once it has ended, None if not shown."""
    if (stat := _stat(pid)) is None:
        return None
    state, *fields = stat
    return _ENDED if state in "ZX" else int(fields[18])


def time_used(pid: int) -> int | None:
    """Processor time of a process while it sleeps, in clock ticks; None while it wants more.

    None as well where it is not shown.
    """
    if (stat := _stat(pid)) is None:
        return None
    state, *fields = stat
    return None if state == "R" else int(fields[10]) + int(fields[11])


def _stat(pid: int) -> list[str] | None:
    """Its state and what follows that in /proc/[pid]/stat; None where it is not shown."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return None
    return stat.rpartition(")")[2].split()


def exists(pid: int) -> bool:
    """Return whether there is such a process, also one that /proc does not show."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


class NoteOfBoot(msgspec.Struct, frozen=True, kw_only=True):
    """Left at the instant `at_ns` (CLOCK_MONOTONIC) of that boot."""

    boot_id: str
    at_ns: Annotated[int, msgspec.Meta(ge=0)]


Note = TypeVar("Note", bound=NoteOfBoot)


def leave_note(path: Path, note: NoteOfBoot, mode: int) -> None:
    """Put it there, in place of the one before, with these permissions. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, msgspec.json.encode(note), mode)


def read_note(path: Path, kind: type[Note]) -> Note | None:
    """Return what was left there in this boot; None for nothing, or what is no such note."""
    try:
        found = msgspec.json.decode(read_file(path), type=kind)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return None
    return found if is_this_boot(found.boot_id) and found.at_ns <= monotonic_ns() else None


PRIORITIES = (60, 61)
"""A run's, which is what its unit allows, and the next one, which a loop that hangs cannot keep off
the processor."""


def come_first() -> None:
    """Take the highest of these that this user may have; where it is none, all stays as it is."""
    with suppress(OSError):
        for priority in PRIORITIES if IS_LINUX else ():
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def keep_off(given: Collection[int]) -> None:
    """Use the other processors only from now on; where none is left, all stays as it is.

    So it does on a system that binds no process to processors.
    """
    if IS_LINUX and given and (others := allowed_cpus().difference(given)):
        with suppress(OSError):
            os.sched_setaffinity(0, others)


@contextmanager
def kept_off(given: Collection[int]) -> Iterator[None]:
    """Let the processes that are started within the block keep off; this one does only there."""
    if not (IS_LINUX and given):
        yield
        return
    before = allowed_cpus()
    keep_off(given)
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, before)
