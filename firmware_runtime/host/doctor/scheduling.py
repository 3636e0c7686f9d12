"""Scheduling: does the loop get the processor when its deadline comes."""

import errno
import gzip
import os
import warnings

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
    CAP_SYS_NICE,
    UNLIMITED,
    SystemFiles,
    cpu_group_file,
    has_capability,
    preemption,
    realtime_priority_limit,
    realtime_throttling,
)

_KEPT_ANOTHER_CLASS = 255
_RAISE_LIMIT = (
    'LimitRTPRIO=60 in the unit, or echo "$USER - rtprio 60" | sudo tee '
    "/etc/security/limits.d/firmware-runtime.conf and log in again"
)
_LET_TAKE = (
    "LimitRTPRIO=60 in the unit and no RestrictRealtime=yes; in a container: --cap-add SYS_NICE "
    "--ulimit rtprio=60"
)
_REALTIME_KERNEL = (
    "sudo apt install linux-image-rpi-v8-rt, then kernel=kernel8_rt.img in "
    "/boot/firmware/config.txt; restart"
)
_NOT_ASKED = "the board asks for no SCHED_FIFO"


def _refused(machine: Machine, seen: str, fix: str) -> Finding:
    """A failure for a board that needs it, else a warning."""
    bad = warning if machine.demands is None else failure
    return bad(seen, fix.replace("60", str(machine.priority)))


def _realtime_limit(machine: Machine) -> Finding:
    if machine.priority == 0:
        return not_applicable(_NOT_ASKED)
    limit = realtime_priority_limit(machine.files)
    if limit is None:
        return not_applicable("/proc/self/limits is not shown")
    if has_capability(machine.files, CAP_SYS_NICE):
        return ok(f"limit {limit}, and CAP_SYS_NICE, which needs none")
    if limit == UNLIMITED or int(limit) >= machine.priority:
        return ok(f"limit {limit}, priority {machine.priority} wanted")
    return _refused(machine, f"limit {limit}, priority {machine.priority} wanted", _RAISE_LIMIT)


def _fifo_granted(machine: Machine) -> Finding:
    if machine.priority == 0:
        return not_applicable(_NOT_ASKED)
    code = try_fifo(machine.priority)
    if code == 0:
        return ok(f"priority {machine.priority} was granted to a child process, which has ended")
    reason = "another class kept" if code == _KEPT_ANOTHER_CLASS else os.strerror(code)
    return _refused(machine, f"priority {machine.priority} refused: {reason}", _LET_TAKE)


def try_fifo(priority: int) -> int:
    """Ask for SCHED_FIFO in a child that ends at once; 0 if granted, or the errno."""
    with warnings.catch_warnings():
        # The child of a process with threads must not take locks: it makes two system calls.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        os._exit(_answer(priority))
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _answer(priority: int) -> int:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return error.errno or errno.EPERM
    return 0 if os.sched_getscheduler(0) == os.SCHED_FIFO else _KEPT_ANOTHER_CLASS


def _realtime_throttling(machine: Machine) -> Finding:
    throttling = realtime_throttling(machine.files)
    runtime, period = throttling.runtime_us, throttling.period_us
    if runtime is None or period is None:
        return not_applicable("/proc/sys/kernel/sched_rt_runtime_us is not shown")
    if runtime == -1:
        return note("no limit: a real-time loop that never waits stops the machine for good")
    seen = f"{runtime} us of every {period} us"
    if runtime == 0:
        return failure(f"{seen}: no real-time class at all")
    return ok(seen) if runtime >= 0.9 * period else warning(seen)


def _realtime_groups(machine: Machine) -> Finding:
    path = cpu_group_file(machine.files, "cpu.rt_runtime_us")
    if path is not None:
        share = machine.files.integer(path)
        if share is None:
            return not_applicable(f"{path} cannot be read")
        seen = f"this process's group may use {share} us ({path})"
        return ok(seen) if share != 0 else failure(seen, f"echo 950000 | sudo tee {path}")
    option = _kernel_option(machine, "CONFIG_RT_GROUP_SCHED")
    if option is None:
        return not_applicable("neither the group nor the kernel's configuration is shown")
    if option == "y":
        return warning("CONFIG_RT_GROUP_SCHED=y: a unit's group has no real-time share of its own")
    return ok("the kernel has no CONFIG_RT_GROUP_SCHED")


def _kernel_option(machine: Machine, name: str) -> str | None:
    """An option of the kernel's configuration, `n` if it is not set, None if none is shown."""
    text = _kernel_configuration(machine.files, machine.kernel_release)
    if text is None:
        return None
    lines = (line.partition("=") for line in text.splitlines())
    return next((value for option, _, value in lines if option == name), "n")


def _kernel_configuration(files: SystemFiles, release: str) -> str | None:
    packed = files.content("/proc/config.gz")
    if packed is None:
        return files.text(f"/boot/config-{release}")
    try:
        return gzip.decompress(packed).decode(errors="replace")
    except (OSError, EOFError):
        return None


def _preemption(machine: Machine) -> Finding:
    model = preemption(machine.files, machine.kernel_build)
    if model is None:
        return not_applicable(f"the kernel's version does not say: {machine.kernel_build!r}")
    if model == "rt":
        return ok("PREEMPT_RT")
    if machine.is_raspberry_pi:
        return note(f"{model}, without PREEMPT_RT", _REALTIME_KERNEL)
    if model == "full":
        return ok("full, without PREEMPT_RT")
    if model == "dynamic":
        return note("chosen at boot; what was chosen is not shown to this user")
    return note(model)


def _timer_slack(machine: Machine) -> Finding:
    slack = machine.files.integer("/proc/self/timerslack_ns")
    if slack is None:
        return not_applicable("/proc/self/timerslack_ns is not shown")
    seen = f"{slack} ns"
    return ok(seen) if slack <= 50_000 else warning(f"{seen}, inherited from what started this")


CHECKS = (
    Check(
        "realtime-limit",
        "SCHED_FIFO lets the loop run before ordinary processes; without CAP_SYS_NICE the kernel "
        "grants no higher priority than this limit.",
        _RAISE_LIMIT,
        _realtime_limit,
    ),
    Check(
        "fifo-granted",
        "Limits allow, and other things still forbid: RestrictRealtime= of a unit, a container, a "
        "control group. So it is tried.",
        _LET_TAKE,
        _fifo_granted,
    ),
    Check(
        "realtime-throttling",
        "Real-time classes together may use so much of each period; a loop that uses it up, by a "
        "long spin for instance, stands still for the rest of it.",
        "sudo sysctl kernel.sched_rt_runtime_us=950000",
        _realtime_throttling,
    ),
    Check(
        "realtime-groups",
        "With CONFIG_RT_GROUP_SCHED each control group has a real-time share of its own, at first "
        "none: SCHED_FIFO is then refused whatever the limits say.",
        "add rt_group_sched=0 to the kernel's command line, or use a kernel without "
        "CONFIG_RT_GROUP_SCHED",
        _realtime_groups,
    ),
    Check(
        "preemption-model",
        "How long kernel code that is under way keeps a loop waiting whose deadline has come.",
        "add preempt=full to the kernel's command line, or install a PREEMPT_RT kernel; on a "
        f"Raspberry Pi: {_REALTIME_KERNEL}",
        _preemption,
    ),
    Check(
        "timer-slack",
        "Without SCHED_FIFO the kernel may wake the loop this much late, to wake several processes "
        "at once.",
        "timer_slack_ns = 1 under [executive] in board.toml; TimerSlackNSec=1 in the unit",
        _timer_slack,
    ),
)
