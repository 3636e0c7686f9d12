"""Memory of the loop: does it stay in RAM."""

from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    not_applicable,
    note,
    ok,
    warning,
)
from firmware_runtime.system.kernel_files import (
    CAP_IPC_LOCK,
    UNLIMITED,
    has_capability,
    memory_lock_limit,
    status,
)

_MIB = 1 << 20
_LOW_MIB = 64
_USUAL_PAGE_KIB = 4


def _lock_limit(machine: Machine) -> Finding:
    if machine.demands is not None and not machine.demands.lock_memory:
        return not_applicable("the board does not ask for locked memory")
    limit = memory_lock_limit(machine.files)
    if limit is None:
        return not_applicable("/proc/self/limits is not shown")
    if has_capability(machine.files, CAP_IPC_LOCK):
        return ok("CAP_IPC_LOCK, which needs no limit")
    if limit == UNLIMITED:
        return ok(UNLIMITED)
    mapped = int((status(machine.files, "VmSize") or "0").split()[0]) * 1024
    seen = f"{int(limit) / _MIB:.0f} MiB; this process alone has mapped {mapped / _MIB:.0f} MiB"
    if int(limit) >= 2 * mapped:
        return ok(seen)
    return warning(seen) if machine.demands is None else failure(seen)


def _swap(machine: Machine) -> Finding:
    if machine.files.text("/proc/swaps") is None:
        return not_applicable("/proc/swaps is not shown")
    areas = [line.split() for line in machine.files.lines("/proc/swaps")[1:]]
    if not areas:
        return ok("none")
    used = sum(int(area[3]) for area in areas) / 1024
    seen = f"{', '.join(area[0] for area in areas)}: {used:.0f} MiB in use"
    return warning(seen) if used > 0 else note(seen)


def _available(machine: Machine) -> Finding:
    for line in machine.files.lines("/proc/meminfo"):
        if line.startswith("MemAvailable:"):
            left = int(line.split()[1]) / 1024
            seen = f"{left:.0f} MiB available"
            return ok(seen) if left >= _LOW_MIB else warning(seen)
    return not_applicable("/proc/meminfo is not shown")


def _page_size(machine: Machine) -> Finding:
    for line in machine.files.lines("/proc/self/smaps"):
        if line.startswith("KernelPageSize:"):
            size = int(line.split()[1])
            return ok("4 KiB") if size == _USUAL_PAGE_KIB else note(f"{size} KiB")
    return not_applicable("/proc/self/smaps is not shown")


CHECKS = (
    Check(
        "memory-lock-limit",
        "Memory that is not locked may be taken away; the step that needs it then waits for the "
        "disk. Locking needs a limit above all that the process maps, or CAP_IPC_LOCK.",
        'LimitMEMLOCK=infinity in the unit, or echo "$USER - memlock unlimited" | sudo tee '
        "/etc/security/limits.d/firmware-runtime-memory.conf and log in again",
        _lock_limit,
    ),
    Check(
        "swap",
        "A page in swap comes back from the disk, on an SD card after tens of milliseconds.",
        "sudo swapoff -a, and without its line in /etc/fstab it stays off (Raspberry Pi OS: sudo "
        "systemctl disable dphys-swapfile)",
        _swap,
    ),
    Check(
        "memory-available",
        "When memory runs out the kernel throws out program code first and ends processes last; "
        "both stop the loop.",
        "end what needs it: ps -eo pid,rss,comm --sort=-rss | head",
        _available,
    ),
    Check(
        "page-size",
        "The own kernel of a Raspberry Pi 5 has pages of 16 KiB: this runtime works with them; "
        "libraries that count on 4 KiB, and programs of 32 bits, do not, and memory goes sooner.",
        "kernel=kernel8.img in /boot/firmware/config.txt has pages of 4 KiB; restart",
        _page_size,
    ),
)
