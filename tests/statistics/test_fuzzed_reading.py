"""Reading a file that is written at full speed, cut short, or damaged: consistent, or refused."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import STEPS, Layout
from firmware_runtime.statistics.mapped_file import PREFIX
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from tests.support.waiting import wait_until

WRITER = """
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
    command = [sys.executable, "-c", WRITER, str(path), str(work_ns)]
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
