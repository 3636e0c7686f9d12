"""What surrounds a run, and scheduling, processors and memory."""

import gzip
import os
import shutil
import sys
import sysconfig
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from firmware_runtime.host.doctor import installation, scheduling
from firmware_runtime.host.doctor.check import Demands, Severity
from firmware_runtime.statistics.layout import GUARD, HEARTBEAT
from tests.support.fake_machines import (
    CPU,
    TACHOBOT,
    Examine,
    allowed,
    container,
    lay_out,
    pc,
    raspberry_pi,
)
from tests.support.written_run import WrittenRun

MIB = 1 << 20
SMAPS = "/proc/self/smaps"


class Usage(NamedTuple):
    free: int


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    directory = tmp_path / "state"
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(directory))
    return directory


def run_under_way(state: Path) -> WrittenRun:
    state.mkdir()
    return WrittenRun(path=state / "tachobot.stats", board="tachobot")


def test_a_run_under_way_is_shown_with_its_process(
    tmp_path: Path, examine: Examine, state: Path
) -> None:
    machine = container(tmp_path, TACHOBOT)
    assert examine("other-run", machine).status is Severity.OK
    run_under_way(state)
    finding = examine("other-run", machine)
    assert (finding.status, finding.seen) == ("note", f"process {os.getpid()} runs tachobot")
    assert examine("other-run", replace(machine, demands=None)).status is Severity.NOTE
    other = replace(machine, demands=replace(TACHOBOT, board="detective"))
    assert examine("other-run", other).status is Severity.OK


def test_a_run_without_a_guard_is_a_warning(tmp_path: Path, examine: Examine, state: Path) -> None:
    machine = container(tmp_path, TACHOBOT)
    assert examine("guard", machine).status is Severity.NOT_APPLICABLE
    run = run_under_way(state)
    run.cells[HEARTBEAT] = 10**12
    finding = examine("guard", machine)
    assert (finding.status, finding.fix) == ("warning", "firmware-runtime guard tachobot")
    run.cells[GUARD] = 10**12
    assert examine("guard", machine).status is Severity.OK


def test_statistics_of_no_use_are_said_to_be_so(
    tmp_path: Path, examine: Examine, state: Path
) -> None:
    state.mkdir()
    (state / "tachobot.stats").write_bytes(b"something else")
    for check in ("other-run", "guard"):
        assert examine(check, container(tmp_path, TACHOBOT)).status is Severity.NOT_APPLICABLE


def test_a_stated_directory_that_is_closed_is_a_failure(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = container(tmp_path)
    assert examine("statistics-directory", machine).status is Severity.OK
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    assert examine("statistics-directory", machine).status is Severity.FAILURE


def test_without_a_stated_directory_there_is_the_one_for_temporary_files(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FIRMWARE_RUNTIME_STATE_DIRECTORY")
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    temporary = tempfile.gettempdir()
    monkeypatch.setattr(os, "access", lambda path, _mode: str(path) == temporary)
    assert examine("statistics-directory", container(tmp_path)).status is Severity.NOTE
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    assert examine("statistics-directory", container(tmp_path)).status is Severity.FAILURE


@pytest.mark.parametrize(
    ("free_mib", "status"),
    [
        ((15, 256), "failure"),
        ((256, 15), "failure"),
        ((255, 256), "warning"),
        ((256, 64), "ok"),
        ((256, 63), "warning"),
    ],
)
def test_room_for_files(
    tmp_path: Path,
    examine: Examine,
    monkeypatch: pytest.MonkeyPatch,
    free_mib: tuple[int, int],
    status: str,
) -> None:
    """On the disk for temporary files, and for statistics in memory."""
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", "/run")
    places = (Path(tempfile.gettempdir()), Path("/run"))
    free = {place: Usage(mib * MIB) for place, mib in zip(places, free_mib, strict=True)}
    monkeypatch.setattr(shutil, "disk_usage", free.__getitem__)
    assert examine("disk-space", container(tmp_path)).status == status


def test_the_watchdog_is_shown_with_its_limit(tmp_path: Path, examine: Examine) -> None:
    finding = examine("watchdog-device", raspberry_pi(tmp_path / "pi"))
    assert finding.seen == "watchdog0: Broadcom BCM2835 Watchdog timer, at most 15 s"
    assert examine("watchdog-device", pc(tmp_path / "pc")).status is Severity.NOTE
    hidden = pc(tmp_path / "other", None, {"/dev/watchdog": ""})
    assert examine("watchdog-device", hidden).status is Severity.OK


def test_the_service_manager(tmp_path: Path, examine: Examine) -> None:
    assert examine("systemd", pc(tmp_path / "pc")).status is Severity.OK
    assert examine("systemd", container(tmp_path / "empty")).status is Severity.NOTE


@pytest.mark.parametrize(
    ("release", "status"),
    [
        ((3, 10), "failure"),
        ((3, 11), "ok"),
        ((3, 12), "warning"),
        ((3, 13), "ok"),
        ((3, 14), "ok"),
        ((3, 15), "warning"),
    ],
)
def test_releases_of_python(
    tmp_path: Path,
    examine: Examine,
    monkeypatch: pytest.MonkeyPatch,
    release: tuple[int, int],
    status: str,
) -> None:
    monkeypatch.setattr(sys, "version_info", release)
    assert examine("python-version", container(tmp_path)).status == status


def test_a_missing_package_is_a_failure(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert examine("bus-packages", container(tmp_path)).status is Severity.OK
    monkeypatch.setattr(installation, "_BUS_PACKAGES", ("no-such-distribution",))
    finding = examine("bus-packages", container(tmp_path))
    assert finding.status is Severity.FAILURE
    assert finding.seen.startswith("no-such-distribution missing from ")


THROTTLED = "/sys/devices/platform/soc/soc:firmware/get_throttled"
NICE, LOCK = 1 << 23, 1 << 14


@pytest.mark.parametrize(
    ("check", "contents", "status", "seen"),
    [
        ("realtime-limit", allowed(priority="50"), "ok", "limit 50"),
        ("realtime-limit", allowed(priority="49"), "failure", "limit 49, priority 50 wanted"),
        ("realtime-limit", allowed(priority="unlimited"), "ok", "unlimited"),
        ("realtime-limit", allowed(capabilities=NICE), "ok", "CAP_SYS_NICE"),
        ("memory-lock-limit", allowed(memory="unlimited"), "ok", "unlimited"),
        ("memory-lock-limit", allowed(memory=str(1 << 30)), "ok", "1024 MiB"),
        ("memory-lock-limit", allowed(), "failure", "has mapped 150 MiB"),
        ("memory-lock-limit", allowed(capabilities=LOCK), "ok", "CAP_IPC_LOCK"),
        ("realtime-throttling", {"/proc/sys/kernel/sched_rt_runtime_us": "-1"}, "note", "no limit"),
        ("realtime-throttling", {"/proc/sys/kernel/sched_rt_runtime_us": "0"}, "failure", "0 us"),
        (
            "realtime-throttling",
            {"/proc/sys/kernel/sched_rt_runtime_us": "500000"},
            "warning",
            "500000 us of every 1000000 us",
        ),
        ("timer-slack", {"/proc/self/timerslack_ns": "50001"}, "warning", "50001 ns"),
        ("governor", {f"{CPU}/cpu3/cpufreq/scaling_governor": "performance"}, "warning", "ondem"),
        ("undervoltage-throttling", {THROTTLED: "0\n"}, "ok", "none"),
        ("undervoltage-throttling", {THROTTLED: "50000\n"}, "warning", "since the start"),
        ("undervoltage-throttling", {THROTTLED: "1\n"}, "failure", "the voltage is too low"),
        ("load", {"/proc/loadavg": "4.00 1 1 5/120 1\n"}, "warning", "4.00 runnable"),
        ("load", {"/proc/pressure/cpu": "some avg10=12.5 avg60=0\n"}, "warning", "12.5 %"),
        ("swap", {"/proc/swaps": "Filename\n/var/swap file 102396 0 -2\n"}, "note", "0 MiB"),
        ("swap", {"/proc/swaps": "Filename\n/var/swap file 102396 2048 -2\n"}, "warning", "2 MiB"),
        ("memory-available", {"/proc/meminfo": "MemAvailable: 32768 kB"}, "warning", "32 MiB"),
        ("preemption-model", {"/sys/kernel/realtime": "0\n"}, "note", "without PREEMPT_RT"),
        ("preemption-model", {"/sys/kernel/realtime": "1\n"}, "ok", "PREEMPT_RT"),
        ("page-size", {SMAPS: "KernelPageSize:       4 kB\n"}, "ok", "4 KiB"),
        ("page-size", {SMAPS: "Rss: 4 kB\nKernelPageSize:       16 kB\n"}, "note", "16 KiB"),
        ("realtime-groups", {"/boot/config-6.6.51+rpt-rpi-v8": "CONFIG_X=y"}, "ok", "no CONFIG"),
    ],
)
def test_what_a_raspberry_pi_shows(
    *,
    tmp_path: Path,
    examine: Examine,
    check: str,
    contents: dict[str, str],
    status: str,
    seen: str,
) -> None:
    finding = examine(check, raspberry_pi(tmp_path, TACHOBOT, contents))
    assert (finding.status, seen in finding.seen) == (status, True), finding


def test_the_remedy_names_the_priority_of_the_board(tmp_path: Path, examine: Examine) -> None:
    machine = raspberry_pi(tmp_path, replace(TACHOBOT, fifo_priority=42))
    assert "LimitRTPRIO=42" in (examine("realtime-limit", machine).fix or "")


def test_a_board_that_asks_for_nothing_is_refused_nothing(tmp_path: Path, examine: Examine) -> None:
    machine = raspberry_pi(tmp_path, Demands("modest"))
    for check in ("realtime-limit", "fifo-granted", "memory-lock-limit"):
        assert examine(check, machine).status is Severity.NOT_APPLICABLE


@pytest.mark.parametrize(
    ("code", "seen"), [(1, "Operation not permitted"), (255, "another class kept")]
)
def test_a_refused_class_is_a_failure(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch, code: int, seen: str
) -> None:
    monkeypatch.setattr(scheduling, "try_fifo", lambda _priority: code)
    finding = examine("fifo-granted", raspberry_pi(tmp_path, TACHOBOT))
    assert (finding.status, seen in finding.seen) == (Severity.FAILURE, True)


def test_trying_a_class_leaves_this_process_in_its_own() -> None:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    assert scheduling.try_fifo(1) in {0, 1}
    assert (os.sched_getscheduler(0), os.sched_getparam(0)) == before
    with suppress(ChildProcessError):  # there is no child; those of other tests may still run
        assert os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None


def test_a_priority_that_there_is_not_is_not_granted() -> None:
    assert scheduling.try_fifo(1000) == 22


@pytest.mark.parametrize(("share", "status"), [("0", "failure"), ("950000", "ok")])
def test_a_group_without_a_realtime_share_is_a_failure(
    tmp_path: Path, examine: Examine, share: str, status: str
) -> None:
    path = "/sys/fs/cgroup/cpu,cpuacct/robot/cpu.rt_runtime_us"
    machine = pc(tmp_path, None, {"/proc/self/cgroup": "4:cpu,cpuacct:/robot", path: share})
    finding = examine("realtime-groups", machine)
    assert finding.status == status
    assert finding.fix in {None, f"echo 950000 | sudo tee {path}"}


def test_the_kernels_own_configuration_shows_realtime_groups(
    tmp_path: Path, examine: Examine
) -> None:
    packed = gzip.compress(b"# configuration\nCONFIG_RT_GROUP_SCHED=y\n")
    machine = pc(tmp_path)
    assert examine("realtime-groups", machine).status is Severity.OK
    lay_out(tmp_path, {"/proc/config.gz": packed})
    assert examine("realtime-groups", machine).status is Severity.WARNING
    lay_out(tmp_path, {"/proc/config.gz": b"no archive"})
    assert examine("realtime-groups", machine).status is Severity.NOT_APPLICABLE


@pytest.mark.parametrize(
    ("build", "status"),
    [
        ("#1 SMP PREEMPT_RT", "ok"),
        ("#1 SMP PREEMPT", "ok"),
        ("#1 SMP", "note"),
        ("?", "not-applicable"),
    ],
)
def test_the_preemption_model(tmp_path: Path, examine: Examine, build: str, status: str) -> None:
    machine = replace(pc(tmp_path), kernel_build=build)
    assert examine("preemption-model", machine).status == status


def test_processors_that_a_board_may_not_use_are_a_failure(
    tmp_path: Path, examine: Examine
) -> None:
    machine = pc(tmp_path, replace(TACHOBOT, cpus=[3, 4]))
    assert examine("allowed-processors", machine).status is Severity.FAILURE
    machine = replace(machine, demands=replace(TACHOBOT, cpus=[3]))
    assert examine("allowed-processors", machine).status is Severity.OK


def test_isolated_processors_are_compared_with_those_of_the_board(
    tmp_path: Path, examine: Examine
) -> None:
    machine = pc(tmp_path, TACHOBOT)
    assert examine("isolated-processors", machine).fix == "cpus = [2, 3] under [executive]"
    machine = replace(machine, demands=replace(TACHOBOT, cpus=[3]))
    assert examine("isolated-processors", machine).status is Severity.OK
    machine = replace(machine, demands=replace(TACHOBOT, cpus=[1]))
    assert "isolcpus=1 nohz_full=1" in (examine("isolated-processors", machine).fix or "")


def test_the_voltage_monitor_is_read_where_the_firmware_is_silent(
    tmp_path: Path, examine: Examine
) -> None:
    machine = raspberry_pi(tmp_path)
    (tmp_path / THROTTLED.lstrip("/")).unlink()
    assert examine("undervoltage-throttling", machine).status is Severity.NOT_APPLICABLE
    monitor = "/sys/class/hwmon/hwmon1"
    lay_out(tmp_path, {f"{monitor}/name": "rpi_volt\n", f"{monitor}/in0_lcrit_alarm": "1\n"})
    assert examine("undervoltage-throttling", machine).status is Severity.FAILURE
    lay_out(tmp_path, {f"{monitor}/in0_lcrit_alarm": "0\n"})
    assert examine("undervoltage-throttling", machine).status is Severity.OK
    logged = "2,900,7,-;hwmon hwmon1: Undervoltage detected!\n6,901,9,-;Voltage normalised\n"
    lay_out(tmp_path, {"/dev/kmsg": 2 * logged})
    finding = examine("undervoltage-throttling", machine)
    assert finding.status is Severity.WARNING
    assert "too low 2 times since the start" in finding.seen


def test_a_raspberry_pi_is_told_of_its_realtime_kernel(tmp_path: Path, examine: Examine) -> None:
    fix = examine("preemption-model", raspberry_pi(tmp_path)).fix or ""
    assert "linux-image-rpi-v8-rt" in fix
    assert "kernel=kernel8_rt.img" in fix


def test_a_kernel_that_does_not_count_who_waits_is_asked_to(
    tmp_path: Path, examine: Examine
) -> None:
    machine = raspberry_pi(tmp_path)
    (tmp_path / "proc/pressure/cpu").unlink()
    finding = examine("load", machine)
    assert finding.status is Severity.NOTE
    assert (finding.fix or "").startswith("psi=1 ")


@pytest.mark.parametrize(
    ("prefix", "is_managed", "status"),
    [("/opt/venv", True, "ok"), ("/usr", True, "note"), ("/usr", False, "ok")],
)
def test_pip_in_the_systems_own_python(
    *,
    tmp_path: Path,
    examine: Examine,
    monkeypatch: pytest.MonkeyPatch,
    prefix: str,
    is_managed: bool,
    status: str,
) -> None:
    monkeypatch.setattr(sys, "prefix", prefix)
    monkeypatch.setattr(sys, "base_prefix", "/usr")
    marker = f"{sysconfig.get_path('stdlib')}/EXTERNALLY-MANAGED"
    machine = raspberry_pi(tmp_path, None, {marker: "[externally-managed]\n"} if is_managed else {})
    assert examine("python-environment", machine).status == status


def test_a_latency_file_closed_to_the_user_is_a_warning_if_the_board_asks(
    tmp_path: Path, examine: Examine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_arguments: False)
    machine = raspberry_pi(tmp_path, TACHOBOT)
    assert examine("cpu-latency-request", machine).status is Severity.WARNING
    assert examine("cpu-latency-request", replace(machine, demands=None)).status is Severity.NOTE
