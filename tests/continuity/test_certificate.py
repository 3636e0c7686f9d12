"""A certificate is a pass only if stages were run and each of them is its replay."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import Status
from firmware_runtime.lab.continuity.certificate import CLAIM, Certificate
from firmware_runtime.lab.continuity.certificate_page import (
    certificate_page,
    signals_of,
)
from firmware_runtime.lab.continuity.stage_run import End, StageRun, all_of, run_stage
from firmware_runtime.lab.stages import staged_run
from firmware_runtime.lab.stages.staged_run import Staged
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.verdict import replay
from firmware_runtime.view.parts import Section, Series, Text, all_parts
from tests.support.recorded import in_chunks, record

PLAN = Staged(board=load("tachobot"), named="tachobot", for_s=1.0)


@pytest.fixture(scope="module")
def end(tmp_path_factory: pytest.TempPathFactory) -> End:
    path = record(tmp_path_factory.mktemp("recorded") / "run.recording", "tachobot", 1)
    recording = read_recording(path)
    return End(recording, replay(recording, board_of(recording.header)))


@pytest.fixture
def run(end: End) -> StageRun:
    return StageRun(Stage.SIMULATION, None, {"whole": end})


def certificate(*runs: StageRun) -> Certificate:
    return Certificate(PLAN, runs)


def test_no_stage_at_all_is_no_pass() -> None:
    of_none = certificate(StageRun(Stage.SIMULATION, "no rig"), StageRun(Stage.EMBEDDED, "no rig"))
    assert not of_none.is_identical
    assert of_none.as_json()["not_run"] == {"simulation": "no rig", "embedded": "no rig"}
    assert of_none.verdict == "no stage was run"
    assert "no stage was run" in str(certificate_page(of_none))


def test_a_stage_that_was_not_run_is_said_and_the_others_count(run: StageRun) -> None:
    of_one = certificate(run, StageRun(Stage.EMBEDDED, "left out"))
    said = of_one.as_json()
    assert of_one.is_identical
    assert of_one.verdict == "identical"
    assert list(said["stages"]) == ["simulation"]
    stage = said["stages"]["simulation"]
    assert (stage["differences"], stage["first_difference"], stage["fault"]) == (0, None, None)
    assert stage["events"] == stage["ends"]["whole"]["events"] > 0
    assert len(said["code_sha256"]) == len(said["settings"]["sha256"]) == 64


def test_a_stage_that_differs_went_wrong_or_is_not_whole_is_no_pass(
    run: StageRun, end: End
) -> None:
    for changed in (
        _with(run, replace(end, verdict=replace(end.verdict, faults=["a section is missing"]))),
        _with(run, replace(end, verdict=replace(end.verdict, steps=0, writes=0))),
        replace(run, failed="the run ended with status 1"),
        StageRun(Stage.EMBEDDED, failed="it did not end within 120 s"),
    ):
        other = replace(changed, stage=Stage.EMBEDDED)
        assert other.fault is not None
        assert not certificate(run, other).is_identical


def test_of_two_ends_the_one_that_is_not_its_replay_is_named(run: StageRun, end: End) -> None:
    cut = replace(end, verdict=replace(end.verdict, faults=["a section is missing"]))
    both = replace(run, stage=Stage.NETWORK, ends={"controller": end, "robot": cut})
    assert not both.is_identical
    assert both.fault == "robot: not whole: a section is missing"
    assert both.total("events") == 2 * end.verdict.events


@pytest.mark.slow
def test_a_run_whose_beginning_was_written_over_is_not_shown_as_a_whole(
    run: StageRun, tmp_path: Path
) -> None:
    path = record(tmp_path / "run.recording", "tachobot", 6, ["recording.minutes=10"])
    path.write_bytes(in_chunks(path, 100))
    recording = read_recording(path)
    late = Recording(path, recording.header, recording.chunks[1:])
    of_late = _with(run, End(late, replay(late, board_of(late.header))))
    assert of_late.fault is not None
    assert "its beginning was written over" in of_late.fault
    assert (of_late.is_identical, certificate(of_late).is_identical) == (None, None)
    assert certificate(of_late).as_json()["identical"] is None
    assert certificate(of_late).status is Status.NOT_ALL_COMPARED
    assert certificate(of_late).verdict == "not all of it was compared"


def test_what_differs_outweighs_what_was_not_compared() -> None:
    assert (all_of([True, None]), all_of([None, False]), all_of([True])) == (None, False, True)


def test_code_that_was_changed_between_two_stages_or_since_is_no_pass(
    run: StageRun, end: End
) -> None:
    header = end.recording.header
    name = next(iter(header.code))
    other = msgspec.structs.replace(header, code={**header.code, name: "another"})
    between = replace(end, recording=msgspec.structs.replace(end.recording, header=other))
    since = replace(end, verdict=replace(end.verdict, code_changed=[name]))
    for changed in (between, since):
        of_both = certificate(run, replace(_with(run, changed), stage=Stage.EMBEDDED))
        assert (of_both.is_identical, of_both.as_json()["same_code"]) == (False, False)
        assert of_both.as_json()["same_settings"]


def test_settings_that_were_changed_between_two_stages_are_no_pass(run: StageRun, end: End) -> None:
    header = msgspec.structs.replace(end.recording.header, table={"board": "tachobot"})
    changed = replace(end, recording=msgspec.structs.replace(end.recording, header=header))
    of_both = certificate(run, replace(_with(run, changed), stage=Stage.EMBEDDED))
    assert (of_both.is_identical, of_both.as_json()["same_settings"]) == (False, False)


def test_an_end_that_has_a_part_of_the_code_has_the_same_code(run: StageRun, end: End) -> None:
    header = end.recording.header
    some = dict(list(header.code.items())[:3])
    other = msgspec.structs.replace(header, code=some)
    part = replace(end, recording=msgspec.structs.replace(end.recording, header=other))
    of_both = certificate(run, replace(_with(run, part), stage=Stage.NETWORK))
    assert of_both.is_identical


def test_the_page_shows_both_stages_and_says_what_was_checked(run: StageRun) -> None:
    page = certificate_page(certificate(run, replace(run, stage=Stage.EMBEDDED)))
    curves = [len(each.curves) for each in all_parts(page.parts) if isinstance(each, Series)]
    assert curves == [1, 1, 4, 4]  # the yaw and four forces
    for said in ("world.yaw_rad", CLAIM[1:], "not compared with one another"):
        assert said in str(page)


def test_what_is_drawn_goes_by_the_names_it_has_in_recordings() -> None:
    assert signals_of(load("tachobot")) == ("world.yaw_rad", ("controller.allocation.forces",))


@pytest.mark.slow
def test_a_recording_of_another_run_in_the_folder_is_not_taken_for_this_one(
    tmp_path: Path, end: End
) -> None:
    (tmp_path / "simulation.recording").write_bytes(end.recording.path.read_bytes())
    plan = replace(PLAN, named=str(tmp_path / "no_board.toml"))
    found = run_stage(plan, Stage.SIMULATION, tmp_path)
    assert not found.has_run
    assert found.why_not is not None
    assert "no such file" in found.why_not


@pytest.mark.slow
def test_a_stage_that_does_not_end_is_ended_and_is_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(staged_run, "_AT_LEAST_S", 0.5)
    monkeypatch.setattr(staged_run, "_TIMES", 0.0)
    found = run_stage(replace(PLAN, for_s=600.0), Stage.SIMULATION, tmp_path)
    assert (found.has_run, found.fault) == (True, "stage simulation: no end within 0.5 s")


def test_a_stage_that_left_nothing_has_its_place_among_the_commands(run: StageRun) -> None:
    failed = StageRun(Stage.EMBEDDED, failed="it did not end")
    page = certificate_page(certificate(run, failed))
    (commands,) = (e for e in page.parts if isinstance(e, Section) and e.title == "Commands")
    assert Text(text="embedded: none") in all_parts([commands])


def test_a_stage_that_left_nothing_is_shown_with_no_event_and_its_fault() -> None:
    of_none = certificate(StageRun(Stage.NETWORK, failed="it did not end within 120 s"))
    stage = of_none.as_json()["stages"]["network"]
    assert (stage["events"], stage["identical"]) == (0, False)
    assert stage["fault"] == "it did not end within 120 s"
    assert of_none.verdict == "not identical"
    assert "did not end within 120 s" in str(certificate_page(of_none))


def _with(run: StageRun, end: End) -> StageRun:
    return replace(run, ends={"whole": end})
