"""Counters of this thread and of its processor by the kernel: read in one go, taken apart later.

Files are opened once and kept: a reading is a few `pread`, some 0.1 ms after a sleep. It is raw
bytes until two of them are compared (`between`), which happens after something was late only. A
file that is not shown, in a container or under a unit with `ProcSubset=pid`, is no fault: what it
says is then None, not measured, and never zero.

Sources: proc(5), getrusage(2), Linux Documentation/scheduler/sched-stats.rst (the three numbers of
`schedstat`), accounting/delay-accounting.rst, Documentation/admin-guide/pm/cpufreq.rst.
"""

import os
import resource
from collections.abc import Callable, Sequence
from time import process_time_ns, thread_time_ns
from typing import NamedTuple

from msgspec import Struct

from firmware_runtime.system.c_library import LIBRARY
from firmware_runtime.system.kernel_files import CPUS, THIS_MACHINE, SystemFiles
from firmware_runtime.system.machine_counters import (
    CONTINUED,
    DISKS,
    FrozenGroups,
    Supply,
    disks_ns,
    throttled_files,
    throttled_ns,
    throttlings,
)

_LARGEST = 1 << 16
_LINE = 256
TICK_NS = 1_000_000_000 // os.sysconf("SC_CLK_TCK")
"""The grain of times in /proc/stat, ns: 10 ms."""
_IRQ, _SOFTIRQ, _STEAL = 5, 6, 7
_BLOCKED_TICKS = 41
_TRACER, _UNTRACED = b"\nTracerPid:", b"\nTracerPid:\t0\n"
_FAIR = {0, 3, 5}
"""SCHED_OTHER, SCHED_BATCH and SCHED_IDLE. Source: sched_setscheduler(2), <linux/sched.h>."""


class Reading(NamedTuple):
    """Everything at one moment, as the kernel writes it; None for what it does not show."""

    cpu_ns: int
    usage: tuple[int, int, int, int]
    """Faults without and with I/O, switches to another thread of our own accord and not."""
    allowed: frozenset[int]
    cpu: int
    continued: int | None
    schedule: bytes | None
    io: bytes | None
    status: bytes | None
    machine: bytes | None
    frequency: bytes | None
    groups: Sequence[bytes | None]
    disks: bytes | None = None
    is_fair: bool = True
    """Whether the thread has an ordinary scheduling class: only those know a quota."""
    membership: bytes | None = None
    """The thread's control groups."""
    process_cpu_ns: int = 0


class Counted(Struct, frozen=True, kw_only=True):
    """Growth of the counters from one reading to the next; None: not measured."""

    cpu_ns: int = 0
    """Processor time of the thread."""
    other_threads_ns: int = 0
    """Of all others of its process."""
    run_delay_ns: int | None = None
    """Time the thread could run and did not."""
    minor_faults: int = 0
    major_faults: int = 0
    voluntary: int = 0
    involuntary: int = 0
    read_bytes: int | None = None
    """From a disk, and to one."""
    written_bytes: int | None = None
    disk_wait_ns: int | None = None
    """Waiting for a disk, in ticks; where the kernel keeps account of delays."""
    disks_ns: int | None = None
    """That the requests to one disk took, the one that had most, in ms."""
    throttled_ns: int | None = None
    """For which control groups of the thread were held back, of all their processors; 0 where the
    thread's scheduling class knows no quota."""
    throttlings: int | None = None
    """In how many periods of their quotas those groups were held back; None and 0 as above."""
    stolen_ns: int | None = None
    """That the host took from the processor, in ticks."""
    interrupt_ns: int | None = None
    """That the processor spent on interrupts, in ticks."""
    interrupts: int | None = None
    """Of the whole machine."""
    continued: int | None = None
    """How often the process was let go on after a stop, or its control group froze or went on."""
    from_cpu: int = 0
    to_cpu: int = 0
    was_regrouped: bool = False
    """Whether the thread has come into other control groups, whose throttling is not known yet."""
    was_moved: bool = False
    """Whether the processors that the thread may use are others."""
    khz_before: int | None = None
    khz: int | None = None


class ThreadCounters:
    """The counters of the thread that makes this object; it must be the one that reads."""

    def __init__(self, files: SystemFiles = THIS_MACHINE) -> None:
        own = "/proc/thread-self"
        self._schedule = _open(files, f"{own}/schedstat")
        self._io = _open(files, f"{own}/io")
        keeps_delays = files.integer("/proc/sys/kernel/task_delayacct") == 1
        self._status = _open(files, f"{own}/stat") if keeps_delays else None
        self._process = _open(files, f"{own}/status")
        self._machine = _open(files, "/proc/stat")
        self._disks = _open(files, DISKS)
        self._frequencies = {
            cpu: _open(files, f"{CPUS}/cpu{cpu}/cpufreq/scaling_cur_freq")
            for cpu in os.sched_getaffinity(0)
        }
        self._files = files
        self._membership = _open(files, f"{own}/cgroup")
        self._member_of = _read(self._membership)
        self._groups = [_open(files, name) for name in throttled_files(files)]
        self._frozen = FrozenGroups(files)
        self.supply = Supply(files)

    def read(self) -> Reading:
        """Read everything that is shown."""
        usage = resource.getrusage(resource.RUSAGE_THREAD)
        cpu: int = LIBRARY.sched_getcpu()
        self._follow_groups()
        return Reading(
            thread_time_ns(),
            (usage.ru_minflt, usage.ru_majflt, usage.ru_nvcsw, usage.ru_nivcsw),
            frozenset(os.sched_getaffinity(0)),
            cpu,
            _either(CONTINUED.times, self._frozen.times),
            _read(self._schedule),
            _read(self._io),
            _read(self._status),
            _read(self._machine),
            _read(self._frequencies.get(cpu)),
            [_read(each) for each in self._groups],
            _read(self._disks),
            os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK in _FAIR,
            self._member_of,
            process_time_ns(),
        )

    def is_traced(self) -> bool:
        """Return whether a tracer, such as strace or a debugger, has this thread now."""
        found = _read(self._process)
        return found is not None and _TRACER in found and _UNTRACED not in found

    def _follow_groups(self) -> None:
        """Open the files of other groups, if the thread was put into other ones."""
        member_of = _read(self._membership)
        if member_of != self._member_of:
            _close(self._groups)
            self._member_of = member_of
            self._groups = [_open(self._files, name) for name in throttled_files(self._files)]
            self._frozen.follow()

    def close(self) -> None:
        """Close the files; what is read after that is not measured."""
        kept = (self._schedule, self._io, self._status, self._machine, self._disks)
        _close([*kept, self._process, *self._frequencies.values(), *self._groups, self._membership])
        self._schedule = self._io = self._status = self._machine = self._disks = None
        self._frequencies, self._groups, self._membership = {}, [], None
        self._member_of = self._process = None
        self._frozen.close()


def between(before: Reading, after: Reading) -> Counted:
    """Return what happened from one reading to the next."""
    minor, major, voluntary, involuntary = (
        now - then for now, then in zip(after.usage, before.usage, strict=True)
    )
    cpu = after.cpu_ns - before.cpu_ns
    machine = [_machine(each.machine, after.cpu) for each in (before, after)]
    steal, interrupt, interrupts = (_grown(*each) for each in zip(*machine, strict=True))
    io = [_io(each.io) for each in (before, after)]
    read, written = (_grown(*each) for each in zip(*io, strict=True))
    return Counted(
        cpu_ns=cpu,
        other_threads_ns=max(after.process_cpu_ns - before.process_cpu_ns - cpu, 0),
        run_delay_ns=_grown(_word(before.schedule, 1), _word(after.schedule, 1)),
        minor_faults=minor,
        major_faults=major,
        voluntary=voluntary,
        involuntary=involuntary,
        read_bytes=read,
        written_bytes=written,
        disk_wait_ns=_in_ns(_grown(_blocked(before.status), _blocked(after.status))),
        disks_ns=disks_ns(before.disks, after.disks),
        throttled_ns=_of_groups(throttled_ns, before, after),
        throttlings=_of_groups(throttlings, before, after),
        stolen_ns=_in_ns(steal),
        interrupt_ns=_in_ns(interrupt),
        interrupts=interrupts,
        continued=_grown(before.continued, after.continued),
        from_cpu=before.cpu,
        to_cpu=after.cpu,
        was_regrouped=before.membership != after.membership,
        was_moved=before.allowed != after.allowed,
        khz_before=_word(before.frequency, 0),
        khz=_word(after.frequency, 0),
    )


def _grown(before: int | None, after: int | None) -> int | None:
    return None if before is None or after is None else after - before


def _either(one: int | None, other: int | None) -> int | None:
    """The sum of what is known."""
    known = [each for each in (one, other) if each is not None]
    return sum(known) if known else None


def _in_ns(ticks: int | None) -> int | None:
    return None if ticks is None else ticks * TICK_NS


def _word(content: bytes | None, index: int) -> int | None:
    """A whole number by its place among the words of a file."""
    try:
        return None if content is None else int(content.split()[index])
    except (ValueError, IndexError):
        return None


def _blocked(status: bytes | None) -> int | None:
    """Read /proc/thread-self/stat, whose second field is a name that may hold blanks."""
    return None if status is None else _word(status.rpartition(b")")[2], _BLOCKED_TICKS - 2)


def _io(content: bytes | None) -> tuple[int | None, int | None]:
    """Bytes read from a disk and written to one."""
    named = dict(line.split(b": ", 1) for line in (content or b"").splitlines() if b": " in line)
    return _word(named.get(b"read_bytes"), 0), _word(named.get(b"write_bytes"), 0)


def _machine(content: bytes | None, cpu: int) -> tuple[int | None, int | None, int | None]:
    """Read /proc/stat: ticks stolen from a processor and spent on interrupts, all interrupts."""
    ticks, steal, interrupt = _words(content, b"\ncpu%d " % cpu), None, None
    if len(ticks) > _STEAL:
        steal, interrupt = ticks[_STEAL], ticks[_IRQ] + ticks[_SOFTIRQ]
    return steal, interrupt, next(iter(_words(content, b"\nintr ")), None)


def _words(content: bytes | None, begin: bytes) -> list[int]:
    """The first numbers of the line that begins so; none where there is no such line."""
    at = -1 if content is None else content.find(begin)
    if content is None or at < 0:
        return []
    rest = content[at + len(begin) : at + len(begin) + _LINE].partition(b"\n")[0]
    return [int(word) for word in rest.split()[: _STEAL + 1] if word.isdigit()]


def _of_groups(
    says: Callable[[bytes | None], int | None], before: Reading, after: Reading
) -> int | None:
    """The sum over the groups that state it, of a class with quotas; None where none does."""
    if before.membership != after.membership:
        return None
    grown = [
        _grown(says(then), says(now)) for then, now in zip(before.groups, after.groups, strict=True)
    ]
    known = [each for each in grown if each is not None]
    if not known:
        return None
    return sum(known) if after.is_fair else 0


def _open(files: SystemFiles, name: str) -> int | None:
    try:
        return os.open(files.path(name), os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None


def _close(descriptors: Sequence[int | None]) -> None:
    for descriptor in descriptors:
        if descriptor is not None:
            os.close(descriptor)


def _read(descriptor: int | None) -> bytes | None:
    try:
        return None if descriptor is None else os.pread(descriptor, _LARGEST, 0)
    except OSError:
        return None
