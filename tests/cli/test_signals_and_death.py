"""The command as a process of its own: stopped by a signal, killed, read from outside."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


@contextmanager
def running() -> Iterator["subprocess.Popen[str]"]:
    """A robot that runs in real time, seen to be running."""
    process = subprocess.Popen(
        [*COMMAND, "run", "tachobot", "--doubles", "--for", "600", "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for_steps(process)
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def wait_for_steps(process: "subprocess.Popen[str]") -> None:
    """Return once the propellers have been driven; each look starts a process, so nothing spins."""
    for _look in range(200):
        if process.poll() is not None:
            break
        if (found := stats()) is not None and found["bus"]["i2c1"]["bytes"] > 4000:
            return
    pytest.fail(f"the run did not get going: {process.poll()}")


def stats() -> dict[str, Any] | None:
    """What another process reads of the run, or None while there is nothing."""
    read = subprocess.run(
        [*COMMAND, "stats", "tachobot", "--json"], capture_output=True, text=True, check=False
    )
    return json.loads(read.stdout) if read.returncode == 0 else None


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_the_run_with_all_outputs_off(number: signal.Signals, status: int) -> None:
    with running() as process:
        process.send_signal(number)
        out, error = process.communicate(timeout=PATIENCE_S)
    document = json.loads(out)
    assert (process.returncode, error) == (status, "")
    assert document["ended"] == {"state": "stopped", "reason": number.name}
    assert document["outputs_on"] == {"thrust_pairs": 0}
    kept = stats()
    assert kept == {**document["statistics"], "takeovers": []}


def test_statistics_are_read_during_the_run_and_after_kill_9(state_directory: Path) -> None:
    with running() as process:
        during = stats()
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=PATIENCE_S)
    after = stats()
    assert during is not None
    assert after is not None
    assert during["conditions"]["run"]["state"] == "running"
    assert after["conditions"]["run"]["state"] == "died"
    assert after["scheduled"] >= during["scheduled"] > 0
    assert after["scheduled"] == after["run"] + after["skipped"] + after["coalesced"]
    assert (state_directory / "tachobot.stats").is_file()


def test_a_run_is_one_thread() -> None:
    with running() as process:
        assert len(list(Path(f"/proc/{process.pid}/task").iterdir())) == 1
