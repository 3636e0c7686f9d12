"""The process of a run on doubles: stalled, it goes on whatever becomes of the page; killed."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.live.run_process import kill, stall

RUN = """
import sys
from pathlib import Path
from tests.support.written_run import WrittenRun
stated = {} if sys.argv[2] == "chips" else {"doubles": sys.argv[2] == "own" or sys.argv[2]}
run = WrittenRun(path=Path(sys.argv[1]), **stated)
print("begun", flush=True)
for line in sys.stdin:
    print(line, end="", flush=True)
"""
STALLER = """
import sys
from pathlib import Path
from firmware_runtime.live.run_process import stall
stall(Path(sys.argv[1]), 0.5)
"""
ROOT = Path(__file__).parents[2]

Begin = Callable[[str], "subprocess.Popen[str]"]


@pytest.fixture
def statistics(tmp_path: Path) -> Path:
    return tmp_path / "robot.statistics"


@pytest.fixture
def begin(statistics: Path) -> Iterator[Begin]:
    """Begin a process with statistics, on these doubles; it says again what it is told."""
    begun: list[subprocess.Popen[str]] = []

    def begin(doubles: str) -> "subprocess.Popen[str]":
        words = [sys.executable, "-c", RUN, str(statistics), doubles]
        process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT
        )
        begun.append(process)
        assert answer(process) == "begun\n"
        return process

    yield begin
    for process in begun:
        process.kill()
        process.communicate()


def answer(process: "subprocess.Popen[str]") -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def echo(process: "subprocess.Popen[str]") -> str:
    assert process.stdin is not None
    process.stdin.write("there\n")
    process.stdin.flush()
    return answer(process)


@pytest.mark.slow
@pytest.mark.parametrize("doubles", ["/run/doubles", "own"])
def test_a_stalled_run_stands_still_and_goes_on(
    statistics: Path, begin: Begin, doubles: str
) -> None:
    process = begin(doubles)
    stall(statistics, 0.05)
    ended = os.waitid(os.P_PID, process.pid, os.WCONTINUED | os.WNOHANG)
    assert ended is not None
    assert ended.si_status == signal.SIGCONT  # and so it was stopped
    assert echo(process) == "there\n"


@pytest.mark.slow
def test_it_goes_on_when_the_page_is_killed_meanwhile(statistics: Path, begin: Begin) -> None:
    process = begin("/run/doubles")
    page = subprocess.Popen([sys.executable, "-c", STALLER, str(statistics)], cwd=ROOT)
    stopped = os.waitid(os.P_PID, process.pid, os.WSTOPPED)
    page.kill()
    assert page.wait() == -signal.SIGKILL
    assert stopped is not None
    assert stopped.si_status == signal.SIGSTOP
    assert echo(process) == "there\n"


@pytest.mark.slow
def test_a_run_on_served_doubles_is_killed(statistics: Path, begin: Begin) -> None:
    process = begin("/run/doubles")
    kill(statistics)
    assert process.wait() == -signal.SIGKILL
    with pytest.raises(ConfigError, match="is over"):
        stall(statistics, 0.1)
    with pytest.raises(ConfigError, match="is over"):
        kill(statistics)


@pytest.mark.slow
def test_a_run_on_chips_is_left_alone(statistics: Path, begin: Begin) -> None:
    process = begin("chips")
    with pytest.raises(ConfigError, match="does not say that it is on doubles"):
        stall(statistics, 0.1)
    with pytest.raises(ConfigError, match="does not say that it is on doubles"):
        kill(statistics)
    assert echo(process) == "there\n"


@pytest.mark.slow
def test_doubles_in_the_run_itself_die_with_it_so_it_is_not_killed(
    statistics: Path, begin: Begin
) -> None:
    process = begin("own")
    with pytest.raises(ConfigError, match="expected doubles that are served"):
        kill(statistics)
    assert echo(process) == "there\n"


@pytest.mark.parametrize("for_s", [0.0, -1.0, 2.1, float("nan"), float(SECOND)])
def test_a_stall_is_short(statistics: Path, for_s: float) -> None:
    with pytest.raises(ConfigError, match="above 0, 2 at most"):
        stall(statistics, for_s)


def test_without_statistics_there_is_no_run(statistics: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        kill(statistics)


def test_where_linux_is_not_both_are_refused(
    statistics: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.system.this_system.IS_LINUX", False)
    with pytest.raises(ConfigError, match="expected Linux"):
        stall(statistics, 0.5)
    with pytest.raises(ConfigError, match="expected Linux"):
        kill(statistics)
