"""On the real clock: identities and order, also of a process that is stopped or killed."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.executive.clocks import Clock, MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.runs.watched_run import WatchedRun
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from tests.support.executives import Run
from tests.support.periodic_models import Robot
from tests.support.phased_models import PERIODS, deadlines
from tests.support.waiting import PATIENCE_S, wait_until

STOPS_S = (0.03, 0.25, 0.09, 0.4)
PROGRAM = """
import json, signal, sys
from pathlib import Path
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from tests.support.phased_models import Board

board = Board()
configuration = Configuration(statistics_path=Path(sys.argv[1]), max_lag=3600 * SECOND)
executive = Executive(board, MonotonicClock(), list, configuration)
signal.signal(signal.SIGTERM, lambda *_: executive.request_stop("asked to"))
outcome = executive.run()
print(json.dumps({"state": outcome.state.name, "cycles": [each.cycles for each in board.periodic]}))
"""


class Running:
    """The board in a process of its own."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(path)],
            stdout=subprocess.PIPE,
            text=True,
            cwd=Path(__file__).parents[2],
        )

    def wait_for(self, elapsed: int) -> None:
        """Wait until the run has come so far, ns."""
        wait_until(lambda: self.elapsed() >= elapsed, f"{elapsed} ns")

    def elapsed(self) -> int:
        """How far it is, ns; 0 where that cannot be read at this moment."""
        try:
            return read_statistics(self.path).cells[ELAPSED]
        except StatisticsFileError:
            return 0

    def stop(self) -> Statistics:
        """Stop the process between two of its sections; return what stands in the file then."""
        while True:
            self.process.send_signal(signal.SIGSTOP)
            os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WNOWAIT)
            try:
                return read_statistics(self.path)
            except StatisticsFileError:  # it was writing, so a reader refuses: not tried here
                self.process.send_signal(signal.SIGCONT)

    def stay_stopped(self, span_s: float) -> None:
        with pytest.raises(subprocess.TimeoutExpired):
            self.process.wait(timeout=span_s)
        self.process.send_signal(signal.SIGCONT)


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    run = Running(tmp_path / "board.stats")
    yield run
    run.process.kill()
    run.process.communicate()


def assert_counted_by_the_clock(statistics: Statistics, *, until: int) -> dict[str, Any]:
    """What is scheduled, and what waits for its turn, is what a clock sees."""
    models: dict[str, Any] = statistics.as_json()["models"]
    for index, period in enumerate(PERIODS):
        model = models[f"model_{index}"]
        assert model["scheduled"] == model["run"] + model["skipped"] + model["coalesced"]
        assert model["scheduled"] + model["waiting"] == deadlines(0, period, until)
        assert model["coalesced"] == model["irregular"] == 0
    return models


@pytest.mark.slow
def test_four_stops_hide_no_period_of_seven_models(running: Running) -> None:
    running.wait_for(100 * MILLISECOND)
    for span_s in STOPS_S:
        stopped = running.stop()
        assert_counted_by_the_clock(stopped, until=stopped.cells[ELAPSED])
        running.stay_stopped(span_s)
        running.wait_for(running.elapsed() + 100 * MILLISECOND)
    running.process.terminate()
    said, _ = running.process.communicate(timeout=PATIENCE_S)
    answer = json.loads(said)
    ended = read_statistics(running.path)
    models = assert_counted_by_the_clock(ended, until=ended.cells[ELAPSED])
    assert answer["state"] == "STOPPED"
    assert [models[f"model_{index}"]["run"] for index in range(len(PERIODS))] == answer["cycles"]
    assert sum(model["skipped"] for model in models.values()) > 0


@pytest.mark.slow
def test_while_it_stands_still_what_is_due_is_counted_all_the_same(running: Running) -> None:
    running.wait_for(100 * MILLISECOND)
    first = running.stop()
    running.wait_for(first.cells[ELAPSED] + 100 * MILLISECOND)
    later = read_statistics(running.path)
    before = assert_counted_by_the_clock(first, until=first.cells[ELAPSED])
    after = assert_counted_by_the_clock(later, until=later.cells[ELAPSED])
    for path, model in after.items():
        assert model["run"] == before[path]["run"]
        assert model["skipped"] >= before[path]["skipped"]
        assert model["waiting"] <= (model["kind"] == "periodic")  # 0: it was within its period
    assert after["model_0"]["skipped"] >= 98
    assert after["model_0"]["waiting"] == 1


@pytest.mark.slow
def test_what_was_due_while_it_hung_is_counted_after_kill_9_if_a_guard_saw_it(
    running: Running,
) -> None:
    def skipped() -> int:
        return int(read_statistics(running.path).as_json()["skipped"])

    running.wait_for(100 * MILLISECOND)
    stopped = running.stop().as_json()["skipped"]
    wait_until(lambda: skipped() > stopped + 50, "the loop is late by the clock")
    seen = skipped()
    WatchedRun(running.path).show_presence()
    running.process.kill()
    running.process.wait()
    after = read_statistics(running.path)
    assert after.as_json()["conditions"]["run"]["state"] == "died"
    assert skipped() >= seen
    for model in after.as_json()["models"].values():
        assert model["scheduled"] == model["run"] + model["skipped"] + model["coalesced"]


@pytest.mark.slow
def test_of_a_run_that_was_killed_every_period_up_to_its_last_word_is_accounted_for(
    running: Running,
) -> None:
    running.wait_for(300 * MILLISECOND)
    running.process.kill()
    running.process.wait()
    killed = read_statistics(running.path)
    models = assert_counted_by_the_clock(killed, until=killed.cells[ELAPSED])
    assert all(model["waiting"] == 0 for model in models.values())


UNTIL = 60 * MILLISECOND


def trace(clock: Clock) -> list[tuple[int, object]]:
    robot = Robot(imu=2 * MILLISECOND)
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    sent: list[tuple[int, object]] = []
    run.executive.simulator.listen(robot.imu.sample, lambda at, value: sent.append((at, value)))
    assert run.until(UNTIL).state is RunState.ENDED
    return sent


@pytest.mark.real_time
@pytest.mark.parametrize("clock", [MonotonicClock(), ScaledClock(3)], ids=["real", "scaled"])
def test_its_trace_is_the_trace_in_virtual_time(clock: Clock) -> None:
    assert trace(clock) == trace(VirtualClock())


@pytest.mark.real_time
@pytest.mark.parametrize("settings", [ProcessSettings(), ProcessSettings(freeze_garbage=True)])
def test_every_activation_is_accounted_for(tmp_path: Path, settings: ProcessSettings) -> None:
    robot = Robot(imu=MILLISECOND, compass=3 * MILLISECOND)
    configuration = Configuration(process=settings, statistics_path=tmp_path / "robot.stats")
    run = Run(robot, MonotonicClock(), configuration)
    run.until(UNTIL)
    scheduled, executed, skipped, coalesced = run.counts()
    assert scheduled == executed + skipped + coalesced == 61 + 21
    assert executed == robot.imu.activations + robot.compass.activations
    assert coalesced == 0


@pytest.mark.real_time
def test_nothing_starts_before_its_deadline() -> None:
    robot = Robot(imu=2 * MILLISECOND)
    clock = MonotonicClock()
    run = Run(robot, clock)
    early: list[int] = []

    def work(_number: int) -> None:
        if clock.now() < run.executive.simulator.now:
            early.append(run.executive.simulator.now)

    robot.imu.work = work
    run.until(UNTIL)
    assert robot.imu.activations > 0
    assert early == []
