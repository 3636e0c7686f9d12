"""A run that a manager starts again and again, as a command of its own."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from firmware_runtime.runs.restarts import Restarts, read_starts
from tests.support.waiting import PATIENCE_S

PROGRAM = (sys.executable, "-m", "firmware_runtime.cli")
COMMAND = (*PROGRAM, "run", "tachobot", "--doubles")


class Manager:
    """Stands for systemd: takes notices, starts the run."""

    def __init__(self, folder: Path) -> None:
        self.statistics = folder / "tachobot.stats"
        self._notify = folder / "notify"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self._notify))
        self._socket.settimeout(PATIENCE_S)

    def start(self, *words: str, command: Sequence[str] = COMMAND) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [*command, "--statistics", str(self.statistics), *words],
            env={**os.environ, "NOTIFY_SOCKET": str(self._notify)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def wait_for(self, what: str) -> str:
        """The next notice with this in it."""
        while what not in (notice := self._socket.recv(4096).decode()):
            pass
        return notice

    @property
    def failed(self) -> int | None:
        starts = read_starts(self.statistics)
        return None if starts is None else starts.failed

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    made = Manager(tmp_path)
    yield made
    made.close()


@pytest.mark.slow
def test_a_run_that_dies_again_and_again_is_counted_until_it_ends_well(manager: Manager) -> None:
    for failed in range(2):
        run = manager.start("--for", "1000")
        manager.wait_for("READY=1")
        assert manager.failed == failed
        run.kill()
        run.wait(PATIENCE_S)
    run = manager.start("--for", "1000")
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "the last 2 starts failed: waits 0.5 s, outputs are off" in said
    manager.wait_for("READY=1")
    run.send_signal(signal.SIGTERM)
    assert run.wait(PATIENCE_S) == 143
    assert manager.failed is None


@pytest.mark.slow
def test_a_wait_is_ended_by_a_stop_and_nothing_was_opened(manager: Manager) -> None:
    for _ in range(12):
        Restarts(manager.statistics).begin()
    run = manager.start()
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "waits 29.5 s" in said
    assert f"EXTEND_TIMEOUT_USEC={89_500_000}" in said
    run.send_signal(signal.SIGTERM)
    assert run.wait(PATIENCE_S) == 143
    assert not manager.statistics.exists()
    assert manager.failed is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("override", "status", "failed"),
    [("controller.yaw.kp=much", 2, None), ("overruns.nothing={}", 2, None)],
)
def test_settings_that_no_start_fixes_do_not_count(
    manager: Manager, override: str, status: int, failed: int | None
) -> None:
    assert manager.start("--set", override).wait(PATIENCE_S) == status
    assert manager.failed == failed


@pytest.mark.slow
def test_a_run_that_no_manager_starts_is_not_counted(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    words = ("--clock", "virtual", "--for", "1", "--json", "--statistics", str(statistics))
    done = subprocess.run([*COMMAND, *words], capture_output=True, timeout=PATIENCE_S, check=True)
    assert json.loads(done.stdout)["ended"]["state"] == "ended"
    assert read_starts(statistics) is None


@pytest.mark.slow
def test_a_guard_that_dies_again_and_again_leaves_the_processor_to_others(manager: Manager) -> None:
    guard = (*PROGRAM, "guard", "tachobot")
    for _ in range(2):
        watching = manager.start(command=guard)
        manager.wait_for("READY=1")
        watching.kill()
        watching.wait(PATIENCE_S)
    assert manager.failed is None
    watching = manager.start(command=guard)
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "the last 2 starts failed: waits 0.5 s, nothing is watched" in said
    manager.wait_for("READY=1")
    watching.send_signal(signal.SIGTERM)
    assert watching.wait(PATIENCE_S) == 0
    assert read_starts(manager.statistics.with_stem("tachobot-guard")) is None
