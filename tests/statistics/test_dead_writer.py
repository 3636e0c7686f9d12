"""What is left of a run whose process was killed."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system.this_process import is_running, this_process

WRITER = """
import sys, time
from pathlib import Path
from firmware_runtime.statistics.layout import STEPS, Layout
from firmware_runtime.statistics.file import StatisticsFile

file = StatisticsFile(Layout(), {"models": {}, "conditions": {}}, Path(sys.argv[1]))
file.open_section()
file.cells[STEPS] = 41
file.close_section(5)
if sys.argv[2] == "half":
    file.open_section()
    file.cells[STEPS] = 42
print("ready", flush=True)
time.sleep(60)
"""


@contextmanager
def writer(path: Path, manner: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-c", WRITER, str(path), manner]
    root = Path(__file__).parents[2]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.slow
def test_the_last_run_can_be_read_after_kill_9(path: Path) -> None:
    with writer(path, "whole") as process:
        alive = read_statistics(path)
        process.send_signal(signal.SIGKILL)
    dead = read_statistics(path)
    assert alive.as_json()["conditions"]["run"]["state"] == "running"
    run = dead.as_json()["conditions"]["run"]
    assert run["state"] == "died"
    assert run["complete"] is True
    assert run["steps"] == 41


@pytest.mark.slow
def test_a_writer_that_died_half_way_through_a_section_is_read_and_said_so(path: Path) -> None:
    with writer(path, "half"):
        pass
    run = read_statistics(path).as_json()["conditions"]["run"]
    assert run["state"] == "died"
    assert run["complete"] is False
    assert run["steps"] == 42


def test_this_process_is_running() -> None:
    assert is_running(this_process())


@pytest.mark.parametrize(
    "other", [{"started_ticks": 1}, {"boot_id": "another"}, {"pid": 2**22 + 1}], ids=str
)
def test_another_process_of_the_same_number_is_not_the_one_that_wrote(
    other: dict[str, object],
) -> None:
    assert not is_running(replace(this_process(), **other))


def test_a_process_that_has_ended_but_was_not_waited_for_is_not_running() -> None:
    pid = os.fork()
    if pid == 0:
        os._exit(0)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    assert not is_running(replace(this_process(), pid=pid))
    os.waitpid(pid, 0)
