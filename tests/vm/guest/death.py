"""Ways to die: every output is off within its time, and the service comes back disarmed.

The times are the goals of docs/safety.md. Where the guest is emulated, five times as long.
"""

import os
import signal
from time import monotonic_ns
from typing import Final

from tests.vm.guest.machine import attempt, expect, run, wait_until
from tests.vm.guest.report import Check
from tests.vm.guest.service import SLOW_TACHOBOT, TACHOBOT

SLOWER: Final = 20 if attempt("systemd-detect-virt").stdout.strip() == "qemu" else 1
"""An emulated guest is five times as slow, and so much more beside a busy host."""
KILL_MS: Final = 300.0 * SLOWER
STALL_MS: Final = SLOW_TACHOBOT["guard.stall_s"] * 1000 + KILL_MS
BOTH_MS: Final = 2500.0 * SLOWER


def a_killed_run_leaves_no_output_on_and_comes_back() -> str:
    """SIGKILL: the guard is there at once."""
    return _dies(signal.SIGKILL, KILL_MS)


def a_crashed_run_leaves_no_output_on_and_comes_back() -> str:
    """SIGSEGV."""
    return _dies(signal.SIGSEGV, KILL_MS)


def a_stopped_run_is_taken_over_and_ended_by_the_watchdog() -> str:
    """SIGSTOP: the guard first, systemd's watchdog then."""
    said = _dies(signal.SIGSTOP, STALL_MS)
    expect(
        "watchdog" in _journal("Watchdog timeout").lower(), "the journal has no watchdog timeout"
    )
    return said


def both_killed_leave_no_output_on() -> str:
    """Run and guard at once: what systemd runs after a unit has ended switches off."""
    TACHOBOT.arm_and_drive()
    pids = (TACHOBOT.pid(TACHOBOT.guard), TACHOBOT.pid())
    at = monotonic_ns()
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
    return _is_off_and_back(at, pids[1], BOTH_MS)


def a_run_out_of_memory_leaves_no_output_on_and_comes_back() -> str:
    """The kernel kills it, as its unit is given less memory than it has."""
    TACHOBOT.arm_and_drive()
    pid, at = TACHOBOT.pid(), monotonic_ns()
    run(
        "systemctl",
        "set-property",
        "--runtime",
        TACHOBOT.runtime,
        "MemoryMax=1M",
        "MemorySwapMax=0",
    )
    wait_until(lambda: TACHOBOT.pid() != pid, "the run is killed")
    said = _took(at, BOTH_MS)
    run("systemctl", "set-property", "--runtime", TACHOBOT.runtime, "MemoryMax=infinity")
    TACHOBOT.wait_until_active()
    expect("oom" in _journal("oom").lower(), "the journal has no out-of-memory kill")
    return said


def a_run_whose_guard_is_killed_disarms_itself() -> str:
    """Within a second; the guard comes back, and does not arm it."""
    TACHOBOT.arm_and_drive()
    pid, guard = TACHOBOT.pid(), TACHOBOT.pid(TACHOBOT.guard)
    at = monotonic_ns()
    os.kill(guard, signal.SIGKILL)
    said = _took(at, 1000 + KILL_MS)
    TACHOBOT.wait_until_active()
    expect(TACHOBOT.pid() == pid, "the run was started again, expected it to go on")
    expect(not TACHOBOT.is_armed(), "it is armed")
    return said


def _dies(number: signal.Signals, limit_ms: float) -> str:
    TACHOBOT.arm_and_drive()
    pid = TACHOBOT.pid()
    return _is_off_and_back(TACHOBOT.signal_run(number), pid, limit_ms)


def _is_off_and_back(at: int, pid: int, limit_ms: float) -> str:
    """All outputs off in time, then another process, active and disarmed."""
    said = _took(at, limit_ms)
    restarts = TACHOBOT.shown("NRestarts")
    wait_until(lambda: TACHOBOT.pid() not in {0, pid}, "another process runs")
    TACHOBOT.wait_until_active()
    back_s = (monotonic_ns() - at) / 1e9
    expect(not TACHOBOT.is_armed(), "it came back armed")
    expect(TACHOBOT.is_off(), "it came back and drives")
    return f"{said}, back after {back_s:.1f} s, restart {restarts}"


def _took(at: int, limit_ms: float) -> str:
    took_ms = TACHOBOT.off_after_ms(at)
    expect(took_ms <= limit_ms, f"off after {took_ms:.0f} ms, expected {limit_ms:.0f} ms at most")
    return f"off after {took_ms:.0f} ms"


def _journal(text: str) -> str:
    return run("journalctl", "-b", "--no-pager", f"--grep={text}", "--case-sensitive=false")


CHECKS: Final[tuple[Check, ...]] = (
    a_killed_run_leaves_no_output_on_and_comes_back,
    a_crashed_run_leaves_no_output_on_and_comes_back,
    a_stopped_run_is_taken_over_and_ended_by_the_watchdog,
    both_killed_leave_no_output_on,
    a_run_out_of_memory_leaves_no_output_on_and_comes_back,
    a_run_whose_guard_is_killed_disarms_itself,
)
