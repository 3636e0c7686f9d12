"""Reading a file that is written at full speed, cut short, damaged, or of a dead writer."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import STATE, STEPS, WRITTEN, Layout
from firmware_runtime.statistics.mapped_file import PREFIX
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.this_process import is_running, this_process
from tests.support.waiting import wait_until

WRITER = """
import sys, time
from pathlib import Path
from firmware_runtime.statistics.layout import STATE, STEPS, WRITTEN, Layout
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


FULL_SPEED = """
import sys
from pathlib import Path
from time import monotonic_ns
from firmware_runtime.devs.time import NEVER
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.periodic_models import Robot

def work(_number):
    until = monotonic_ns() + work_ns
    while monotonic_ns() < until:
        pass

work_ns = int(sys.argv[2])
robot = Robot(imu=1_000, compass=3_000)  # due again before a step is over: the loop never waits
robot.imu.work = work
configuration = Configuration(
    policies={"imu": ActivationPolicy("catch-up")},
    statistics_path=Path(sys.argv[1]),
    max_lag=NEVER,
)
Executive(robot, MonotonicClock(), lambda: [], configuration).run()
"""


@pytest.fixture(params=[0, 50_000], ids=["empty", "50 us"])
def work_ns(request: pytest.FixtureRequest) -> int:
    """How long a step works besides being counted."""
    span: int = request.param
    return span


@pytest.fixture
def written_at_full_speed(work_ns: int, tmp_path: Path) -> Iterator[Path]:
    """The statistics of a loop that never waits."""
    path = tmp_path / "robot.stats"
    command = [sys.executable, "-c", FULL_SPEED, str(path), str(work_ns)]
    with subprocess.Popen(command, cwd=Path(__file__).parents[2]) as writer:
        wait_until(path.exists, "the loop has begun")
        yield path
        assert writer.poll() is None
        writer.kill()


def assert_consistent(statistics: Statistics) -> None:
    counted = statistics.as_json()
    for index, (path, model) in enumerate(counted["models"].items()):
        assert model["scheduled"] == model["run"] + model["skipped"] + model["coalesced"], path
        lateness = Histogram(statistics.cells[statistics.layout.lateness(index)])
        own_time = Histogram(statistics.cells[statistics.layout.step(index)])
        assert lateness.samples == model["run"]
        if model["kind"] == "event":
            assert own_time.samples == model["run"] + model["reactions"]
        else:  # that of an activation is known when the next one begins
            assert own_time.samples == max(model["run"] - 1, 0)
        assert lateness.largest <= lateness.sum <= lateness.largest * max(lateness.samples, 1)
        assert model["overruns"] <= model["run"]
    assert counted["step_us"]["max"] is None or counted["conditions"]["run"]["steps"] > 0


@pytest.mark.slow
@pytest.mark.real_time
def test_a_file_written_at_full_speed_is_read_consistently_or_refused(
    written_at_full_speed: Path, work_ns: int
) -> None:
    steps = [0]
    for _ in range(300):
        try:
            statistics = read_statistics(written_at_full_speed)
        except StatisticsFileError as error:
            refusal = str(error)
            break
        assert_consistent(statistics)
        steps.append(statistics.cells[STEPS])
    else:
        refusal = ""
    assert steps == sorted(steps)
    if work_ns > 0:
        assert refusal == ""
        assert steps[-1] > steps[1]
    else:  # the pauses between two sections may be shorter than a copy takes
        assert steps[-1] > 0 or "writes without a pause" in refusal


@given(st.integers(0, 10_000))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_file_cut_anywhere_is_refused(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "robot.stats"
    StatisticsFile(Layout(worst=1), {"models": {}, "conditions": {}}, path)
    os.truncate(path, cut % path.stat().st_size)
    with pytest.raises(StatisticsFileError):
        read_statistics(path)


@pytest.mark.slow
@given(st.integers(0, 10_000), st.binary(min_size=1, max_size=16))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damage_before_the_cells_is_refused_or_makes_no_difference(
    counted: StatisticsFile, path: Path, place: int, damage: bytes
) -> None:
    whole = path.read_bytes()
    header_end = PREFIX.size + PREFIX.unpack(whole[: PREFIX.size])[3]
    at = place % header_end
    damaged = whole[:at] + damage + whole[at + len(damage) :]
    path.write_bytes(damaged[: len(whole)])
    try:
        read = read_statistics(path)
    except StatisticsFileError:
        pass
    else:
        assert read.cells.tolist() == counted.cells.tolist()
    finally:
        path.write_bytes(whole)


@pytest.mark.parametrize("count", [-1, -(1 << 63), (1 << 62) + 1, (1 << 63) - 1])
@pytest.mark.parametrize("state", [RunState.RUNNING, RunState.ENDED])
def test_what_no_run_can_have_counted_is_refused(
    tmp_path: Path, count: int, state: RunState
) -> None:
    layout = Layout(models=("imu", "esc"), buses=("i2c1",), worst=1)
    stated = {"period_ns": 1, "tolerance_ns": 0, "policy": "skip"}
    header = {"models": {"imu": stated, "esc": stated}, "conditions": {}, "clock_speed": 1.0}
    for at in (STEPS, layout.model(1) + 1, layout.bus(0), layout.lateness(0).start):
        path = tmp_path / "robot.stats"
        file = StatisticsFile(layout, header, path)
        file.cells[STATE] = state
        file.cells[WRITTEN] = 1
        read_statistics(path).as_json()
        file.cells[at] = count
        with pytest.raises(StatisticsFileError, match="what no run can have counted"):
            read_statistics(path)
