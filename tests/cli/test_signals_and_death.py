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

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.reader import read_statistics
from tests.support.waiting import PATIENCE_S, wait_until

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
        wait_until(lambda: steps() > 200 or process.poll() is not None, "its propellers turn")
        assert process.poll() is None
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def steps() -> int:
    """How many steps the run has made; 0 before it has begun."""
    try:
        return read_statistics(default_path("tachobot")).cells[STEPS]
    except StatisticsFileError:
        return 0


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


def test_a_run_is_one_thread_and_its_statistics_are_read_while_it_lives_and_after_kill_9(
    state_directory: Path,
) -> None:
    with running() as process:
        assert len(list(Path(f"/proc/{process.pid}/task").iterdir())) == 1
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
