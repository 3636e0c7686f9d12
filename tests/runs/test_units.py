"""The units in `systemd`, judged by systemd itself, and the system calls that they allow."""

import json
import platform
import shutil
import signal
import subprocess
import sys
from configparser import RawConfigParser
from importlib.resources import files
from pathlib import Path

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.host.installation.plan import (
    GUARD,
    PROGRAM,
    ROS2,
    RUNTIME,
    SERVICES,
)
from firmware_runtime.runs.restarts import FIRST_PAUSE
from tests.support.installation_rig import install
from tests.support.system_call_filter import HEADER, allowed_calls

SYSTEM_UNITS = Path("/usr/lib/systemd/system")
NEEDED = ("sysinit.target", "basic.target", "shutdown.target", "multi-user.target")
REPOSITORY = Path(__file__).parents[2]
with_systemd = pytest.mark.skipif(
    shutil.which("systemd-analyze") is None or not SYSTEM_UNITS.is_dir(),
    reason="needs systemd-analyze of the Debian package systemd",
)


with_filter = pytest.mark.skipif(
    not (shutil.which("systemd-analyze") and platform.machine() == "x86_64" and HEADER.exists()),
    reason="needs x86_64 and the Debian packages systemd and linux-libc-dev",
)


class Unit(RawConfigParser):
    """A unit with its last word on everything; that is enough for settings that occur once."""

    def __init__(self, service: str) -> None:
        super().__init__(strict=False, delimiters=("=",), comment_prefixes=("#",))
        self.optionxform = str  # type: ignore[assignment,method-assign] # names keep their case
        self.read_string((REPOSITORY / "systemd" / f"{service}@.service").read_text())


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A system with both boards installed, and what their units refer to."""
    for board in kinds.names():
        install(board, tmp_path)
    units = tmp_path / "usr/lib/systemd/system"
    units.mkdir(parents=True)
    for name in NEEDED:
        shutil.copy(SYSTEM_UNITS / name, units)
    for program in (PROGRAM, "/bin/kill"):
        stub = tmp_path / program.lstrip("/")
        stub.parent.mkdir(parents=True, exist_ok=True)
        stub.write_text("#!/bin/sh\n")
        stub.chmod(0o755)
    return tmp_path


def analyze(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["systemd-analyze", *map(str, words)], capture_output=True, text=True, check=False
    )


@with_systemd
@pytest.mark.parametrize("board", kinds.names())
def test_systemd_finds_no_fault_in_the_units(root: Path, board: str) -> None:
    units = [f"{service}@{board}.service" for service in SERVICES]
    verified = analyze("verify", "--man=no", f"--root={root}", *units)
    assert (verified.returncode, verified.stdout, verified.stderr) == (0, "", "")


@with_systemd
def test_systemd_would_find_a_fault(root: Path) -> None:
    unit = root / "etc/systemd/system/firmware-runtime@.service"
    unit.write_text(unit.read_text().replace("WatchdogSec=2", "WatchdogSec=soon"))
    verified = analyze("verify", "--man=no", f"--root={root}", f"{RUNTIME}@tachobot.service")
    assert "Failed to parse sec value, ignoring: soon" in verified.stderr


@with_systemd
def test_a_board_without_priority_is_no_fault_either(root: Path) -> None:
    copy = root / "etc/firmware-runtime/tachobot.toml"
    copy.write_text(copy.read_text().replace("fifo_priority = 60", "fifo_priority = 0"))
    install("tachobot", root)
    units = [f"{service}@tachobot.service" for service in (RUNTIME, GUARD)]
    verified = analyze("verify", "--man=no", f"--root={root}", *units)
    assert (verified.returncode, verified.stderr) == (0, "")


@with_systemd
@pytest.mark.parametrize("board", kinds.names())
@pytest.mark.parametrize("service", SERVICES)
def test_a_service_is_exposed_to_little(root: Path, board: str, service: str) -> None:
    unit = f"{service}@{board}.service"
    judged = analyze("security", "--offline=true", "--threshold=15", f"--root={root}", unit)
    assert judged.returncode == 0, judged.stdout.splitlines()[-1]
    assert "Overall exposure level" in judged.stdout


def test_units_are_the_files_at_the_top_of_the_repository() -> None:
    packaged = files("firmware_runtime.host.installation") / "units"
    top = {path.name: path.read_text() for path in (REPOSITORY / "systemd").iterdir()}
    assert {each.name: each.read_text() for each in packaged.iterdir()} == top
    assert len(top) == 10


def test_a_service_that_is_ready_says_so_and_shows_itself() -> None:
    for service, patience in ((RUNTIME, "2"), (GUARD, "5"), (ROS2, "30")):
        unit = Unit(service)["Service"]
        reported = (unit["Type"], unit["NotifyAccess"], unit["WatchdogSec"])
        assert reported == ("notify", "main", patience)


def test_a_run_is_started_again_after_the_pause_that_its_own_waiting_counts_on() -> None:
    run = Unit(RUNTIME)
    assert run["Service"]["RestartSec"] == f"{FIRST_PAUSE // MILLISECOND}ms"
    assert run["Unit"]["StartLimitIntervalSec"] == "0"


def test_outputs_are_switched_off_after_every_end_of_the_run() -> None:
    after = Unit(RUNTIME)["Service"]["ExecStopPost"]
    settings = "/etc/firmware-runtime/%i.toml"
    assert after == f"{PROGRAM} safe-state {settings} --reason=${{SERVICE_RESULT}}"


def test_the_guard_starts_before_the_run_and_outlives_it() -> None:
    run, guard = Unit(RUNTIME), Unit(GUARD)
    assert run["Unit"]["Wants"] == run["Unit"]["After"] == f"{GUARD}@%i.service"
    assert guard["Service"]["Restart"] == "always"
    assert not {"PartOf", "BindsTo", "StopPropagatedFrom"} & set(guard["Unit"])


def test_the_guard_has_the_higher_priority_and_only_the_guard_starts_with_it() -> None:
    run, guard = Unit(RUNTIME)["Service"], Unit(GUARD)["Service"]
    assert int(guard["LimitRTPRIO"]) == int(run["LimitRTPRIO"]) + 1
    assert guard["CPUSchedulingPriority"] == guard["LimitRTPRIO"]
    assert "CPUSchedulingPolicy" not in run
    assert int(guard["OOMScoreAdjust"]) < int(run["OOMScoreAdjust"])


def test_guard_and_run_live_in_the_same_sandbox() -> None:
    """But for what the guard has no use for, they differ in nothing that restricts them."""
    own = {
        "ExecStart", "ExecReload", "ExecStopPost", "Restart", "RestartSec", "SuccessExitStatus",
        "CPUSchedulingPolicy", "CPUSchedulingPriority", "LimitRTPRIO", "OOMScoreAdjust",
        "SystemCallFilter", "TimeoutStopSec", "WatchdogSec",
    }  # fmt: skip
    run, guard = (dict(Unit(service)["Service"]) for service in (RUNTIME, GUARD))
    assert {k: v for k, v in run.items() if k not in own} == {
        k: v for k, v in guard.items() if k not in own
    }


def test_a_run_that_was_stopped_has_not_failed() -> None:
    assert Unit(RUNTIME)["Service"]["SuccessExitStatus"] == "130 143"


def test_real_time_is_not_taken_away() -> None:
    for service in (RUNTIME, GUARD):
        assert Unit(service)["Service"]["RestrictRealtime"] == "no"


FILTER = REPOSITORY / "tests/support/system_call_filter.py"
RUN = REPOSITORY / "systemd/firmware-runtime@.service"
GUARDED = REPOSITORY / "systemd/firmware-runtime-guard@.service"


def command(unit: Path, *words: object) -> list[str]:
    """The project's command under the filter of a unit."""
    own = [sys.executable, "-m", "firmware_runtime.cli", *map(str, words)]
    return [sys.executable, str(FILTER), str(unit), *own]


@with_filter
def test_the_filter_is_that_of_the_unit() -> None:
    allowed = allowed_calls(RUN.read_text())
    assert {"read", "ioctl", "mlockall", "sched_setscheduler", "sched_setaffinity"} <= allowed
    assert not {"mbind", "setpriority", "mount", "ptrace", "clock_settime", "chown"} & allowed


@with_filter
@pytest.mark.parametrize("what", ["bridge", "record", "ros2"])
def test_what_runs_beside_a_run_may_keep_off_its_processors(what: str) -> None:
    unit = REPOSITORY / f"systemd/firmware-runtime-{what}@.service"
    assert "sched_setaffinity" in allowed_calls(unit.read_text())


@with_filter
def test_what_the_filter_forbids_fails() -> None:
    nice = [sys.executable, str(FILTER), str(RUN), sys.executable, "-c", "import os; os.nice(1)"]
    ended = subprocess.run(nice, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "PermissionError: [Errno 1]" in ended.stderr


@with_filter
@pytest.mark.slow
def test_a_run_gets_what_it_asks_for(tmp_path: Path) -> None:
    words = (
        "run",
        "tachobot",
        "--doubles",
        "--for",
        "1",
        "--json",
        "--set",
        "executive.cpus=[0]",
    )
    asked = {}
    for sandboxed in (False, True):
        own = [*words, "--statistics", tmp_path / f"{sandboxed}.stats"]
        whole = command(RUN, *own)
        ended = subprocess.run(
            whole if sandboxed else whole[3:], capture_output=True, text=True, check=False
        )
        assert ended.returncode == 0, ended.stderr
        settings = json.loads(ended.stdout)["statistics"]["conditions"]["settings"]
        asked[sandboxed] = {name: setting["granted"] for name, setting in settings.items()}
    assert asked[True] == asked[False]


@with_filter
@pytest.mark.slow
def test_a_guard_watches_and_ends(tmp_path: Path) -> None:
    words = command(GUARDED, "guard", "tachobot", "--statistics", tmp_path / "tachobot.stats")
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as guard:
        assert guard.stdout is not None
        assert guard.stdout.readline().startswith(f"guard: watching {tmp_path}/tachobot.stats")
        guard.send_signal(signal.SIGTERM)
    assert guard.returncode == 0
