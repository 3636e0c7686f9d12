"""Trees of files that look like the /proc, /sys and /dev of a Raspberry Pi 4, a PC, a container."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TypeAlias

from firmware_runtime.host.doctor.check import Demands, Finding, Machine
from firmware_runtime.system.kernel_files import SystemFiles

Contents: TypeAlias = Mapping[str, str | bytes]
"""What stands in files, by their usual path."""

Examine: TypeAlias = Callable[[str, Machine], Finding]
"""Carries out one check, by its id."""

CPU = "/sys/devices/system/cpu"
CLOCK = "/sys/devices/system/clocksource/clocksource0"
ADAPTER = "/sys/bus/i2c/devices/i2c-1"
PI_BUILD = "#1 SMP PREEMPT Debian 1:6.6.51-1+rpt3 (2024-10-08)"
PC_BUILD = "#1 SMP PREEMPT_DYNAMIC Debian 6.1.119-1 (2024-11-22)"
TACHOBOT = Demands(
    board="tachobot",
    bus_hz={"/dev/i2c-1": 400_000},
    addresses={"/dev/i2c-1": [0x68, 0x40, 0x41]},
    fifo_priority=50,
    lock_memory=True,
    keep_cpu_awake=True,
)

_LIMITS = """Limit                     Soft Limit           Hard Limit           Units
Max locked memory         {memory:<20} {memory:<20} bytes
Max realtime priority     {priority:<20} {priority:<20}
"""
_STATUS = "Name:\tpython3\nVmSize:\t  153600 kB\nCapEff:\t{capabilities}\nCpus_allowed_list:\t0-3\n"

_COMMON: Contents = {
    "/proc/sys/kernel/sched_rt_runtime_us": "950000\n",
    "/proc/sys/kernel/sched_rt_period_us": "1000000\n",
    "/proc/self/timerslack_ns": "50000\n",
    "/proc/self/limits": _LIMITS.format(memory=8388608, priority=0),
    "/proc/self/status": _STATUS.format(capabilities="0" * 16),
    "/proc/self/cgroup": "0::/user.slice/session-1.scope\n",
    "/proc/loadavg": "0.10 0.20 0.30 1/120 4711\n",
    "/proc/pressure/cpu": "some avg10=0.50 avg60=0.40 avg300=0.30 total=1\n",
    "/proc/meminfo": "MemTotal: 4000000 kB\nMemFree: 1 kB\nMemAvailable: 3000000 kB\n",
    "/proc/swaps": "Filename\tType\tSize\tUsed\tPriority\n",
    "/run/systemd/system/marker": "",
    f"{CPU}/online": "0-3\n",
    f"{CPU}/isolated": "\n",
}
_RASPBERRY_PI: Contents = {
    **_COMMON,
    "/proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.4\0",
    "/proc/device-tree/compatible": "raspberrypi,4-model-b\0brcm,bcm2711\0",
    "/proc/cpuinfo": "processor\t: 0\nFeatures\t: fp asimd evtstrm crc32 cpuid\n",
    "/proc/cmdline": "console=serial0,115200 console=tty1 root=PARTUUID=1 rootwait",
    "/sys/class/tty/console/active": "tty1 ttyS0\n",
    "/dev/ttyS0": "",
    "/dev/gpiochip0": "",
    "/dev/i2c-1": "",
    "/dev/cpu_dma_latency": "",
    f"{ADAPTER}/name": "bcm2835 (i2c@7e804000)\n",
    f"{ADAPTER}/of_node/clock-frequency": (100_000).to_bytes(4, "big"),
    "/sys/module/pinctrl_bcm2835/parameters/persist_gpio_outputs": "Y\n",
    "/sys/devices/platform/soc/soc:firmware/get_throttled": "50005\n",
    "/sys/class/watchdog/watchdog0/identity": "Broadcom BCM2835 Watchdog timer\n",
    "/sys/class/watchdog/watchdog0/max_timeout": "15\n",
    f"{CLOCK}/current_clocksource": "arch_sys_counter\n",
    f"{CLOCK}/available_clocksource": "arch_sys_counter \n",
    f"{CPU}/cpu0/cpufreq/scaling_governor": "ondemand\n",
    f"{CPU}/nohz_full": "(null)\n",
}
_PC: Contents = {
    **_COMMON,
    "/proc/cpuinfo": "processor\t: 0\nflags\t\t: fpu tsc msr constant_tsc nonstop_tsc\n",
    "/proc/cmdline": "BOOT_IMAGE=/vmlinuz root=/dev/sda1 quiet",
    "/sys/class/tty/console/active": "tty0\n",
    "/sys/class/dmi/id/sys_vendor": "LENOVO\n",
    "/boot/config-6.1.0-28-amd64": "CONFIG_PREEMPT_DYNAMIC=y\n# CONFIG_RT_GROUP_SCHED is not set\n",
    "/sys/kernel/debug/sched/preempt": "none (voluntary) full\n",
    f"{CLOCK}/current_clocksource": "hpet\n",
    f"{CLOCK}/available_clocksource": "tsc hpet acpi_pm \n",
    f"{CPU}/cpu0/cpufreq/scaling_governor": "performance\n",
    f"{CPU}/cpu1/cpufreq/scaling_governor": "performance\n",
    f"{CPU}/isolated": "2-3\n",
    f"{CPU}/nohz_full": "3\n",
}


def lay_out(root: Path, contents: Contents) -> SystemFiles:
    """Write these files below a root; those that are there already are written again."""
    for name, content in contents.items():
        path = root / name.lstrip("/")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return SystemFiles(root)


def link(root: Path, name: str, target: str | Path) -> None:
    """Make a symbolic link below a root."""
    path = root / name.lstrip("/")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.symlink_to(target)


def allowed(
    *, memory: str = "8388608", priority: str = "0", capabilities: int = 0
) -> dict[str, str]:
    """The files that say what the calling process may do."""
    return {
        "/proc/self/limits": _LIMITS.format(memory=memory, priority=priority),
        "/proc/self/status": _STATUS.format(capabilities=f"{capabilities:016x}"),
    }


def raspberry_pi(
    root: Path, demands: Demands | None = None, contents: Contents = MappingProxyType({})
) -> Machine:
    """A Raspberry Pi 4 as it comes: slow bus, a console on its UART, too weak a supply."""
    files = lay_out(root, {**_RASPBERRY_PI, **contents})
    link(root, "/dev/serial0", "ttyS0")
    return Machine(files, demands, "6.6.51+rpt-rpi-v8", PI_BUILD)


def pc(
    root: Path, demands: Demands | None = None, contents: Contents = MappingProxyType({})
) -> Machine:
    """A PC without any I2C bus, with two isolated processors and a slow clock source."""
    files = lay_out(root, {**_PC, **contents})
    return Machine(files, demands, "6.1.0-28-amd64", PC_BUILD)


def container(root: Path, demands: Demands | None = None) -> Machine:
    """A container that shows nothing at all."""
    return Machine(SystemFiles(root), demands, "6.1.0", "an unusual build")
