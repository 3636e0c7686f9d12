"""A run and its guard get along with the system calls that their units leave them."""

import json
import platform
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.system_call_filter import HEADER, allowed_calls

REPOSITORY = Path(__file__).parents[2]
FILTER = REPOSITORY / "tests/support/system_call_filter.py"
RUN = REPOSITORY / "systemd/firmware-runtime@.service"
GUARD = REPOSITORY / "systemd/firmware-runtime-guard@.service"

pytestmark = [
    pytest.mark.skipif(
        shutil.which("systemd-analyze") is None,
        reason="needs systemd-analyze of the Debian package systemd",
    ),
    pytest.mark.skipif(
        platform.machine() != "x86_64" or not HEADER.exists(),
        reason="needs x86_64 and the Debian package linux-libc-dev",
    ),
]


def command(unit: Path, *words: object) -> list[str]:
    """The project's command under the filter of a unit."""
    own = [sys.executable, "-m", "firmware_runtime.cli", *map(str, words)]
    return [sys.executable, str(FILTER), str(unit), *own]


def test_the_filter_is_that_of_the_unit() -> None:
    allowed = allowed_calls(RUN.read_text())
    assert {"read", "ioctl", "mlockall", "sched_setscheduler", "sched_setaffinity"} <= allowed
    assert not {"mbind", "setpriority", "mount", "ptrace", "clock_settime", "chown"} & allowed


@pytest.mark.parametrize("what", ["bridge", "record", "ros2"])
def test_what_runs_beside_a_run_may_keep_off_its_processors(what: str) -> None:
    unit = REPOSITORY / f"systemd/firmware-runtime-{what}@.service"
    assert "sched_setaffinity" in allowed_calls(unit.read_text())


def test_what_the_filter_forbids_fails() -> None:
    nice = [sys.executable, str(FILTER), str(RUN), sys.executable, "-c", "import os; os.nice(1)"]
    ended = subprocess.run(nice, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert "PermissionError: [Errno 1]" in ended.stderr


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


@pytest.mark.slow
def test_a_guard_watches_and_ends(tmp_path: Path) -> None:
    words = command(GUARD, "guard", "tachobot", "--statistics", tmp_path / "tachobot.stats")
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as guard:
        assert guard.stdout is not None
        assert guard.stdout.readline().startswith(f"guard: watching {tmp_path}/tachobot.stats")
        guard.send_signal(signal.SIGTERM)
    assert guard.returncode == 0
