"""What the kernel writes of a thread, its groups, disks and clocks, in the kernel's own formats.

Each function gives files by their usual path, as they stand after so much more has been counted
than in `RASPBERRY_PI` and `PC`.

Sources: proc(5), Linux Documentation/admin-guide/iostats.rst, admin-guide/cgroup-v2.rst,
scheduler/sched-bwc.rst, scheduler/sched-stats.rst; drivers/firmware/raspberrypi.c (`%x`).
"""

SCHEDSTAT, IO = "/proc/thread-self/schedstat", "/proc/thread-self/io"
STATUS, STAT, DISKS = "/proc/thread-self/stat", "/proc/stat", "/proc/diskstats"
MEMBERSHIP, OWN_GROUPS = "/proc/thread-self/cgroup", "/proc/self/cgroup"
FLAGS = "/sys/devices/platform/soc/soc:firmware/get_throttled"
GROUP_2 = "/sys/fs/cgroup/system.slice/tachobot.service/cpu.stat"
ABOVE_2 = "/sys/fs/cgroup/system.slice/cpu.stat"
GROUP_1 = "/sys/fs/cgroup/cpu,cpuacct/robots/cpu.stat"
_CPUS = range(64)
"""More than a machine has that runs the tests."""

_STAT = """cpu  {total} 0 0
cpu0 183 0 95 13022 31 0 4 0 0 0
cpu1 171 0 93 13051 24 {irq} {softirq} {steal} 0 0
cpu10 1 2 3 4 5 6 7 8 9 10
intr {interrupts} 0 31 0 0 8801 0 0 0 4242
ctxt 230914
btime 1795000000
processes 2113
procs_running 2
procs_blocked 0
softirq 31337 2 9000 12 801 640 0 33 12001 0 8848
"""
_IO = """rchar: 190211
wchar: 4413
syscr: 312
syscw: 77
read_bytes: {read}
write_bytes: {written}
cancelled_write_bytes: 0
"""
_STATUS = (
    "4711 (firmware (run)) S 1 4711 4711 0 -1 4194304 901 0 3 0 41 17 0 0 -51 0 1 0 8112 231989248 "
    "8123 18446744073709551615 1 1 0 0 0 0 0 16781312 16386 0 0 0 17 1 50 1 {blocked} 0 0 0 0 0 "
    "0 0 0 0 0\n"
)
_DISK = (
    "   7       0 loop0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n"
    " 179       0 mmcblk0 5120 211 401922 {read} 902 1733 21044 {write} 0 9120 15210 0 0 0 0 44 "
    "{flush}\n"
    " 179       1 mmcblk0p1 120 11 4922 91 2 3 44 12 0 120 210 0 0 0 0 0 0\n"
)
_GROUP_2 = """usage_usec 81231991
user_usec 61231991
system_usec 20000000
nice_usec 0
core_sched.force_idle_usec 0
nr_periods 912
nr_throttled {times}
throttled_usec {usec}
nr_bursts 0
burst_usec 0
"""
_GROUP_1 = """nr_periods 912
nr_throttled {times}
throttled_time {ns}
nr_bursts 0
burst_time 0
"""


def waited(ns: int) -> dict[str, str]:
    """The thread could run for so long, and did not."""
    return {SCHEDSTAT: f"{812_000_000} {41_000_000 + ns} {9_120}\n"}


def wrote(written: int) -> dict[str, str]:
    """So many bytes went to a disk."""
    return {IO: _IO.format(read=401_408, written=61_440 + written)}


def disk_worked(read_ms: int = 0, write_ms: int = 0, flush_ms: int = 0) -> dict[str, str]:
    """Requests to the card took so long."""
    times = {"read": 4031 + read_ms, "write": 11022 + write_ms, "flush": 157 + flush_ms}
    return {DISKS: _DISK.format(**times)}


def machine(irq: int = 0, softirq: int = 0, steal: int = 0, interrupts: int = 0) -> dict[str, str]:
    """Processor 1 had so many more ticks of each; the machine so many more interrupts."""
    ticks = {"irq": 7 + irq, "softirq": 19 + softirq, "steal": 3 + steal}
    total = f"354 0 188 26073 55 {ticks['irq']} {23 + softirq} {ticks['steal']}"
    return {STAT: _STAT.format(total=total, interrupts=51_231 + interrupts, **ticks)}


def throttled_for(ns: int, times: int = 3) -> dict[str, str]:
    """The groups were held back for so long, in the words of both versions."""
    return {
        GROUP_2: _GROUP_2.format(times=times, usec=120_000 + ns // 1000),
        ABOVE_2: _GROUP_2.format(times=0, usec=0),
        GROUP_1: _GROUP_1.format(times=times, ns=120_000_000 + ns),
    }


def clock_at(khz: int) -> dict[str, str]:
    """All processors at one clock."""
    cpus = "/sys/devices/system/cpu"
    return {f"{cpus}/cpu{each}/cpufreq/scaling_cur_freq": f"{khz}\n" for each in _CPUS}


def status(blocked: int = 0) -> str:
    """The thread's line, with so many ticks spent waiting for a disk."""
    return _STATUS.format(blocked=blocked)


_COMMON: dict[str, str] = {
    **waited(0),
    **wrote(0),
    **disk_worked(),
    **machine(),
    **clock_at(1_800_000),
    STATUS: status(),
}
RASPBERRY_PI: dict[str, str] = {
    **_COMMON,
    **{name: content for name, content in throttled_for(0).items() if name != GROUP_1},
    "/proc/sys/kernel/task_delayacct": "0\n",
    OWN_GROUPS: "0::/system.slice/tachobot.service\n",
    MEMBERSHIP: "0::/system.slice/tachobot.service\n",
    "/proc/self/mounts": "/dev/mmcblk0p2 / ext4 rw,noatime 0 0\n"
    "cgroup2 /sys/fs/cgroup cgroup2 rw,nosuid,nodev,noexec,relatime,nsdelegate 0 0\n",
    FLAGS: "0\n",
}
PC: dict[str, str] = {
    **_COMMON,
    **{name: content for name, content in throttled_for(0).items() if name == GROUP_1},
    "/proc/sys/kernel/task_delayacct": "1\n",
    OWN_GROUPS: "4:memory:/\n3:cpu,cpuacct:/robots\n1:name=systemd:/init.scope\n0::/\n",
    "/proc/self/mounts": "/dev/sda1 / ext4 rw,relatime 0 0\n"
    "cgroup /sys/fs/cgroup/cpu,cpuacct cgroup rw,nosuid,relatime,cpu,cpuacct 0 0\n"
    "cgroup /sys/fs/cgroup/memory cgroup rw,nosuid,relatime,memory 0 0\n",
}
