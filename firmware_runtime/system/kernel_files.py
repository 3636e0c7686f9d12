"""Files of the kernel: what it says of itself, of the processors and of the calling process.

They are read below a root that tests put elsewhere. What is absent, hidden or refused reads as None
or as empty: in a container, or under a unit with `ProcSubset=pid`, much of /proc is not shown, and
no reader may stumble over that.

Sources: proc(5), getrlimit(2), capabilities(7), cgroups(7); Linux Documentation/scheduler/
sched-rt-group.rst, kernel/sched/debug.c (file `preempt`), init/Makefile (the words of the version),
Documentation/ABI/testing/dev-kmsg,
admin-guide/kernel-parameters.txt (isolcpus, nohz_full), admin-guide/pm/cpufreq.rst,
Documentation/virt and the device trees of its machines for the marks that a hypervisor leaves.
"""

import os
import re
from collections.abc import Iterator
from io import FileIO
from pathlib import Path

from msgspec import Struct


class SystemFiles(Struct, frozen=True):
    """Files of the kernel by their usual absolute path, such as `/proc/loadavg`."""

    root: Path = Path("/")

    def path(self, name: str) -> Path:
        """Return where a file really is."""
        return self.root / name.lstrip("/")

    def content(self, name: str) -> bytes | None:
        """All bytes of a file, None if it cannot be read."""
        try:
            return self.path(name).read_bytes()
        except OSError:
            return None

    def text(self, name: str) -> str | None:
        """A file's text without the line end or the zero byte it closes with."""
        content = self.content(name)
        return None if content is None else content.decode(errors="replace").strip("\0\n ")

    def lines(self, name: str) -> list[str]:
        """A file's lines; none if it cannot be read."""
        return (self.text(name) or "").splitlines()

    def integer(self, name: str) -> int | None:
        """The whole number a file consists of, None if it is something else."""
        text = self.text(name)
        try:
            return None if text is None else int(text)
        except ValueError:
            return None

    def exists(self, name: str) -> bool:
        """Return whether there is such a file, as far as this user can see."""
        try:
            return self.path(name).exists()
        except OSError:
            return False

    def matching(self, pattern: str) -> list[str]:
        """The usual paths that match a pattern such as `/dev/i2c-*`, in order."""
        try:
            found = sorted(self.root.glob(pattern.lstrip("/")))
        except OSError:
            return []
        return [f"/{path.relative_to(self.root)}" for path in found]


THIS_MACHINE = SystemFiles()


def cpu_list(text: str | None) -> list[int] | None:
    """The processors of a list such as `0-2,5`; none in an empty one, None if it is no list.

    A kernel built for it but started without writes `(null)`, which is empty too.
    """
    if text is None:
        return None
    cpus: list[int] = []
    for part in text.replace("(null)", "").split(","):
        first, _, last = part.strip().partition("-")
        try:
            cpus += range(int(first), int(last or first) + 1) if first else ()
        except ValueError:
            return None
    return cpus


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
    """Return how many bytes this process may keep in RAM without CAP_IPC_LOCK."""
    return limit(files, "Max locked memory")


def has_capability(files: SystemFiles, number: int) -> bool:
    """Return whether a capability is in effect."""
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


def kernel_log(files: SystemFiles) -> list[str] | None:
    """Lines of the kernel's log since the start, oldest first; None if not shown to this user."""
    for name in ("/dev/kmsg", "/var/log/kern.log"):
        try:
            descriptor = os.open(files.path(name), os.O_RDONLY | os.O_NONBLOCK)
        except OSError:
            continue
        with open(descriptor, "rb", buffering=0) as log:  # noqa: PTH123 -- an open descriptor
            return b"".join(_records(log)).decode(errors="replace").splitlines()
    return None


def _records(log: FileIO) -> Iterator[bytes]:
    """All that is there now: /dev/kmsg gives a record a read, and would wait for the next."""
    while True:
        try:
            record = log.read(1 << 16)
        except BrokenPipeError:  # this one was overwritten meanwhile
            continue
        except OSError:
            return
        if not record:
            return
        yield record


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
    """Return how readily the kernel lets a waiting thread in; None for a version that does not say.

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
    """Return what debugfs shows in parentheses, or the kernel's command line."""
    shown = re.search(_CHOSEN, files.text("/sys/kernel/debug/sched/preempt") or "")
    at_boot = re.search(_AT_BOOT, files.text("/proc/cmdline") or "")
    found = shown or at_boot
    return found[1] if found else None


def clock_source(files: SystemFiles) -> str | None:
    """Return what the kernel reads the time from."""
    return files.text(f"{_CLOCK_SOURCES}/current_clocksource")


def clock_sources(files: SystemFiles) -> list[str]:
    """All it could read the time from, the best first."""
    return (files.text(f"{_CLOCK_SOURCES}/available_clocksource") or "").split()


CPUS = "/sys/devices/system/cpu"
_VIRTUAL_MAKERS = (
    *("QEMU", "KVM", "VMware", "innotek", "VirtualBox", "Xen", "Bochs", "Parallels", "bhyve"),
    *("Virtual Machine", "Google Compute Engine", "OpenStack", "HVM domU"),
)
"""Parts of what DMI calls the maker or the product of a virtual machine."""
_VIRTUAL_BOARD = "linux,dummy-virt"
"""What the device tree of QEMU, crosvm and Firecracker calls its machine."""


def governors(files: SystemFiles) -> list[str]:
    """The governors in use, each once; none where frequency scaling is not shown."""
    shown = map(files.text, files.matching(f"{CPUS}/cpu[0-9]*/cpufreq/scaling_governor"))
    return sorted({governor for governor in shown if governor})


def isolated(files: SystemFiles) -> list[int] | None:
    """Processors the scheduler leaves alone (isolcpus=); None if the kernel does not say."""
    return cpu_list(files.text(f"{CPUS}/isolated"))


def tickless(files: SystemFiles) -> list[int] | None:
    """Processors without a periodic tick (nohz_full=); None if the kernel cannot do it."""
    return cpu_list(files.text(f"{CPUS}/nohz_full"))


def online(files: SystemFiles) -> int | None:
    """Return how many processors are switched on; None if the kernel does not say."""
    cpus = cpu_list(files.text(f"{CPUS}/online"))
    return len(cpus) if cpus else None


def computer_model(files: SystemFiles) -> str | None:
    """The computer by its device tree, `Raspberry Pi 4 Model B Rev 1.4`; else its processor."""
    named = files.text("/proc/device-tree/model")
    lines = [] if named else (files.text("/proc/cpuinfo") or "").splitlines()
    return named or next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")), None
    )


def virtualised(files: SystemFiles) -> bool | None:
    """Return whether a hypervisor is underneath; None where that is unknown.

    A device tree without any mark of one counts as that of a real computer.
    """
    flags = _flags(files)
    if _hypervisor_shown(files) or "hypervisor" in flags or _virtual_maker(files):
        return True
    if flags or files.exists("/proc/device-tree/compatible"):
        return False
    return None


def _flags(files: SystemFiles) -> list[str]:
    """The flags of the first processor; none on Arm, where they do not show it."""
    named = (line for line in files.lines("/proc/cpuinfo") if line.startswith("flags"))
    return next(named, "").partition(":")[2].split()


def _hypervisor_shown(files: SystemFiles) -> bool:
    compatible = (files.text("/proc/device-tree/compatible") or "").split("\0")
    return (
        files.exists("/sys/hypervisor/type")
        or files.exists("/proc/device-tree/hypervisor")
        or bool(files.matching("/proc/device-tree/fw-cfg@*"))
        or _VIRTUAL_BOARD in compatible
    )


def _virtual_maker(files: SystemFiles) -> bool:
    names = [
        files.text(f"/sys/class/dmi/id/{name}") or "" for name in ("sys_vendor", "product_name")
    ]
    return any(maker in name for maker in _VIRTUAL_MAKERS for name in names)
