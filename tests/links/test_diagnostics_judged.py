"""Levels of `/diagnostics`, by what went wrong lately."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from msgspec import structs

from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.links.ros2 import judgement
from firmware_runtime.links.ros2.judgement import (
    LATELY,
    OFTEN,
    Judge,
    Level,
    Status,
    TopicJudge,
    flat,
)
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics import reader
from firmware_runtime.statistics.figures import FaultFigures, Figures
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import Layout

IMU = "tachobot: imu"


@dataclass
class Running:
    """Statistics of a run under way, with figures of a test's own."""

    kept: Figures
    state: RunState = RunState.RUNNING
    writer_alive: bool = True
    heartbeat_age_ns: int | None = 0

    def figures(self) -> Figures:
        return self.kept

    def overruns(self, count: int) -> None:
        imu = structs.replace(self.kept.models["imu"], overruns=count)
        self.kept = structs.replace(self.kept, models={**self.kept.models, "imu": imu})


@pytest.fixture(scope="module")
def figures() -> Figures:
    board = registry.load("tachobot")
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    session.run(SECOND)
    return session.executive.statistics.figures()


@pytest.fixture
def run(figures: Figures, monkeypatch: pytest.MonkeyPatch) -> Running:
    running = Running(figures)
    monkeypatch.setattr(judgement, "read_statistics", lambda _path: running)
    return running


@pytest.fixture
def judge() -> Judge:
    return Judge("tachobot", Path("tachobot.stats"))


def at(judge: Judge, now: int) -> dict[str, Status]:
    return {status.name: status for status in judge.judge(now)}


def test_what_went_wrong_before_the_first_look_is_not_lately(run: Running, judge: Judge) -> None:
    run.overruns(50)
    assert {status.level for status in judge.judge(0)} == {Level.OK}


def test_one_is_a_warning_and_ten_are_an_error_until_ten_seconds_have_passed(
    run: Running, judge: Judge
) -> None:
    at(judge, 0)
    run.overruns(1)
    found = at(judge, SECOND)
    assert (found[IMU].level, found["tachobot: run"].level) == (Level.WARN, Level.WARN)
    assert "imu" in found["tachobot: run"].message
    run.overruns(OFTEN)
    assert at(judge, 2 * SECOND)[IMU].level == Level.ERROR
    assert at(judge, 2 * SECOND + LATELY)[IMU].level == Level.OK


def test_faults_count_and_the_last_is_named(run: Running, judge: Judge) -> None:
    at(judge, 0)
    fault = FaultFigures(count=1, first_s=0.5, last_s=0.5, last="the chip is gone")
    run.kept = structs.replace(run.kept, faults={"imu": {"NoAcknowledge": fault}})
    found = at(judge, SECOND)[IMU]
    assert found.level == Level.WARN
    assert "the chip is gone" in found.message
    assert found.values["faults.NoAcknowledge.count"] == "1"


def test_a_loop_that_stands_still_is_an_error(run: Running, judge: Judge) -> None:
    run.heartbeat_age_ns = 2 * SECOND
    assert at(judge, 0)["tachobot: run"].level == Level.ERROR


def test_a_run_that_stands_still_half_way_through_its_counting_is_an_error_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "TIMEOUT_S", 0.0)
    path = tmp_path / "tachobot.stats"
    StatisticsFile(Layout(), {"models": {}, "conditions": {}}, path).open_section()
    (status,) = Judge("tachobot", path).judge(0)
    assert (status.level, "stands still" in status.message) == (Level.ERROR, True)


@pytest.mark.parametrize(("state", "alive"), [(RunState.ENDED, True), (RunState.RUNNING, False)])
def test_a_run_that_is_over_is_stale_with_its_last_numbers(
    run: Running, judge: Judge, state: RunState, *, alive: bool
) -> None:
    run.state, run.writer_alive = state, alive
    found = judge.judge(0)
    assert {status.level for status in found} == {Level.STALE}
    assert found[0].values["scheduled"] == str(run.kept.scheduled)


def test_another_run_begins_at_nothing(run: Running, judge: Judge) -> None:
    run.overruns(40)
    at(judge, 0)
    run.overruns(0)
    assert at(judge, SECOND)[IMU].level == Level.OK


def test_no_statistics_are_stale(tmp_path: Path) -> None:
    (status,) = Judge("tachobot", tmp_path / "none.stats").judge(0)
    assert status.level == Level.STALE


def test_what_was_not_measured_is_left_out() -> None:
    assert dict(flat({"a": {"b": None, "c": 0, "d": "text"}})) == {"a.c": "0", "a.d": "text"}


# Of a node's topics -------------------------------------------------------------------------------


def test_before_the_first_message_nothing_is_said() -> None:
    assert TopicJudge("rover").judge({}, 0) == []


def test_counts_are_shown_and_what_was_refused_is_a_warning_for_ten_seconds() -> None:
    judge = TopicJudge("rover")
    (status,) = judge.judge({"published": 3, "inactive": 2, "refused": 1}, 0)
    assert (status.name, status.level) == ("rover: topics", Level.OK)  # of a time before
    assert status.values == {"published": "3", "inactive": "2", "refused": "1"}
    (status,) = judge.judge({"published": 9, "refused": 3}, SECOND)
    assert status.level == Level.WARN
    assert status.message == "in the last 10 s: 2 refused"
    (status,) = judge.judge({"published": 9, "refused": 3}, 12 * SECOND)
    assert status.level == Level.OK
