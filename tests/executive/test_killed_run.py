"""A run in a process of its own that is stopped, or killed, while another process reads it."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.runs.watched_run import WatchedRun
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from tests.support.waiting import PATIENCE_S, wait_until

PROGRAM = """
import sys
from pathlib import Path
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.system.signals import stop_on_signals
from tests.support.periodic_models import Robot

def make_safe():
    print("safe", flush=True)
    return []

robot = Robot(imu=MILLISECOND, compass=3 * MILLISECOND)
configuration = Configuration(statistics_path=Path(sys.argv[1]))
executive = Executive(robot, MonotonicClock(), make_safe, configuration)
with stop_on_signals(executive.request_stop):
    print("ready", flush=True)
    print(executive.run(60 * SECOND).reason)
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "robot.stats"


@pytest.fixture
def process(path: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", PROGRAM, str(path)]
    root = Path(__file__).parents[2]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root) as started:
        assert started.stdout is not None
        assert started.stdout.readline() == "ready\n"
        yield started
        started.kill()


def read_after_steps(path: Path, steps: int) -> Statistics:
    """Read again and again, as `stats` would, until so many steps were made."""
    for _ in range(100_000):
        if path.exists():
            statistics = read_statistics(path)
            assert_identity(statistics.as_json())
            if statistics.as_json()["conditions"]["run"]["steps"] >= steps:
                return statistics
    raise AssertionError(f"not {steps} steps in 100,000 readings")


def assert_identity(counted: dict[str, Any]) -> None:
    for each in (counted, *counted["models"].values()):
        assert each["scheduled"] == each["run"] + each["skipped"] + each["coalesced"]


@pytest.mark.slow
def test_statistics_are_read_during_the_run_and_after_kill_9(
    process: subprocess.Popen[str], path: Path
) -> None:
    during = read_after_steps(path, 50)
    process.send_signal(signal.SIGKILL)
    process.wait()
    after = read_statistics(path).as_json()
    assert during.as_json()["conditions"]["run"]["state"] == "running"
    assert after["conditions"]["run"]["state"] == "died"
    assert after["run"] >= during.as_json()["run"] > 0
    assert_identity(after)


@pytest.mark.slow
def test_what_was_due_while_it_hung_is_counted_after_kill_9_if_a_guard_saw_it(
    process: subprocess.Popen[str], path: Path
) -> None:
    read_after_steps(path, 50)
    stopped = stop(process, path).as_json()["skipped"]
    wait_until(lambda: skipped(path) > stopped + 50, "the loop is late by the clock")
    seen = skipped(path)
    WatchedRun(path).show_presence()
    process.send_signal(signal.SIGKILL)
    process.wait()
    after = read_statistics(path).as_json()
    assert after["conditions"]["run"]["state"] == "died"
    assert after["skipped"] >= seen
    assert_identity(after)


def stop(process: subprocess.Popen[str], path: Path) -> Statistics:
    """Stop the process between two of its sections; return what stands in the file then."""
    while True:
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        try:
            return read_statistics(path)
        except StatisticsFileError:  # it was writing, so a reader refuses: not tried here
            process.send_signal(signal.SIGCONT)


def skipped(path: Path) -> int:
    counted: int = read_statistics(path).as_json()["skipped"]
    return counted


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_makes_outputs_safe_and_the_statistics_say_so(
    process: subprocess.Popen[str], path: Path, number: signal.Signals
) -> None:
    read_after_steps(path, 5)
    process.send_signal(number)
    said, _ = process.communicate(timeout=PATIENCE_S)
    assert said == f"safe\nsafe\n{number.name}\n"
    assert process.returncode == 0
    after = read_statistics(path).as_json()
    assert after["conditions"]["run"]["state"] == "stopped"
    assert_identity(after)
