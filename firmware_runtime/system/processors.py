"""The processors: which are kept free, how fast they are clocked, whether they are real.

Sources: Linux Documentation/admin-guide/kernel-parameters.txt (isolcpus, nohz_full),
admin-guide/pm/cpufreq.rst; Documentation/virt and the device trees of its machines for the marks
that a hypervisor leaves.
"""

from firmware_runtime.system.files import SystemFiles, cpu_list

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
    """How many processors are switched on; None if the kernel does not say."""
    cpus = cpu_list(files.text(f"{CPUS}/online"))
    return len(cpus) if cpus else None


def computer_model(files: SystemFiles) -> str | None:
    """What the device tree calls this computer, such as `Raspberry Pi 4 Model B Rev 1.4`."""
    return files.text("/proc/device-tree/model")


def virtualised(files: SystemFiles) -> bool | None:
    """Whether a hypervisor is underneath; None where that is unknown.

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
