"""A certificate is a pass only if stages were run and every one of them is equal."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.continuity.certificate import Certificate
from firmware_runtime.continuity.page import certificate_page
from firmware_runtime.continuity.signals import numbers_in, quantiles_us
from firmware_runtime.continuity.stage_run import Plan, StageRun
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.part_recording.of_board import replay_of
from firmware_runtime.part_recording.recording import Recording, read_recording
from firmware_runtime.part_recording.records import Entered
from firmware_runtime.recording.of_board import board_of
from firmware_runtime.runs.recorded_run import recorded
from firmware_runtime.runs.session import Session
from firmware_runtime.stages.stage import Stage


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("recorded") / "run.recording"
    session = Session(load("tachobot"), VirtualClock(), doubles=True, statistics_path=None)
    with recorded(session, path, print) as ended:
        ended(session.run(1_000_000_000))
    session.close()
    return read_recording(path)


@pytest.fixture(scope="module")
def comparison(recording: Recording) -> Comparison:
    return replay_of(recording, board_of(recording.header))


@pytest.fixture
def run(recording: Recording, comparison: Comparison) -> StageRun:
    return StageRun(Stage.SIMULATION, None, comparison, recording)


def certificate(*runs: StageRun) -> Certificate:
    return Certificate(Plan(load("tachobot"), "tachobot", 1.0), runs)


def test_no_stage_at_all_is_no_pass() -> None:
    of_none = certificate(StageRun(Stage.SIMULATION, "no rig"), StageRun(Stage.EMBEDDED, "no rig"))
    assert not of_none.is_equal
    assert of_none.as_json()["not_run"] == {"simulation": "no rig", "embedded": "no rig"}
    assert of_none.verdict == "no stage was run"
    assert "no stage was run" in certificate_page(of_none)


def test_a_stage_that_was_not_run_is_said_and_the_others_count(run: StageRun) -> None:
    of_one = certificate(run, StageRun(Stage.EMBEDDED, "left out"))
    said = of_one.as_json()
    assert of_one.is_equal
    assert of_one.verdict == "equal"
    assert list(said["stages"]) == ["simulation"]
    assert said["stages"]["simulation"]["differences"] == 0
    assert said["stages"]["simulation"]["first_difference"] is None
    assert said["stages"]["simulation"]["events"] > 0
    assert len(said["code_sha256"]) == len(said["settings"]["sha256"]) == 64


def test_a_stage_that_differs_went_wrong_or_is_not_whole_is_no_pass(
    run: StageRun, comparison: Comparison
) -> None:
    for changed in (
        replace(run, comparison=replace(comparison, differences=1)),
        replace(run, comparison=replace(comparison, fault="records were dropped")),
        replace(run, failed="the run ended with status 1"),
        StageRun(Stage.EMBEDDED, failed="it did not end within 120 s"),
    ):
        assert not certificate(run, replace(changed, stage=Stage.EMBEDDED)).is_equal


def test_code_that_was_changed_between_two_stages_is_no_pass(
    run: StageRun, recording: Recording
) -> None:
    header = recording.header
    other = msgspec.structs.replace(header, code_sha256="another")
    changed = Recording(other, recording.records, 0, recording.ended)
    assert not certificate(run, replace(run, stage=Stage.EMBEDDED, recording=changed)).is_equal


def test_the_page_shows_both_stages_and_the_shown_value(run: StageRun) -> None:
    page = certificate_page(certificate(run, replace(run, stage=Stage.EMBEDDED)))
    assert page.count("<polyline") == 2 * (1 + 4)  # the yaw and four forces
    assert "tachobot.world.yaw_rad" in page
    assert "no link" in page


def test_numbers_of_a_value_are_named_by_where_they_are() -> None:
    value = {"f1": 1.0, "name": "x", "pair": [2, True]}
    assert list(numbers_in(value, "out")) == [
        ("out.f1", 1.0),
        ("out.pair[0]", 2.0),
        ("out.pair[1]", 1.0),
    ]


def test_ages_that_are_not_known_are_not_shown_as_zero(recording: Recording) -> None:
    assert quantiles_us(recording) is None
    entered = [Entered(at, 0, 0, 0, age, 1.0) for at, age in enumerate([3000, None, 1000, 2000])]
    aged = Recording(recording.header, list(entered), 0, None)
    assert quantiles_us(aged) == {
        "imu.sample": {"p50": 2.0, "p99": 3.0, "max": 3.0, "count": 3},
    }


def test_a_plan_says_where_everything_is_kept(tmp_path: Path) -> None:
    plan = Plan(load("tachobot", ["world.seed=3"]), "tachobot", 2.0)
    words = plan.words(Stage.SIMULATION, tmp_path)
    assert words[:4] == ["run", "tachobot", "--stage", "simulation"]
    assert words[-2:] == ["--set", "world.seed=3"]
    assert str(tmp_path / "simulation.recording") in words


def test_a_stage_that_left_nothing_is_shown_with_no_event_and_its_fault() -> None:
    of_none = certificate(StageRun(Stage.NETWORK, failed="it did not end within 120 s"))
    stage = of_none.as_json()["stages"]["network"]
    assert (stage["events"], stage["equal"]) == (0, False)
    assert stage["fault"] == "it did not end within 120 s"
    assert of_none.verdict == "not equal"
    assert "did not end within 120 s" in certificate_page(of_none)
