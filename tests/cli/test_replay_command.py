"""`run --record` and `replay`: equal, or the first difference; other files are refused."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.recording.recording import read_recording
from firmware_runtime.status import Status
from firmware_runtime.system.conditions import versions_here
from tests.support.recorded import record


@pytest.fixture
def recording(command: Callable[..., Any], tmp_path: Path) -> Path:
    path = tmp_path / "flight.recording"
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1.5", "--record", path)
    ended = command(*words)
    assert (ended.status, ended.error) == (Status.OK, "")
    return path


@pytest.mark.slow
def test_a_run_is_equal_to_its_replay(command: Callable[..., Any], recording: Path) -> None:
    ended = command("replay", recording)
    assert ended.status == Status.OK
    assert ended.out.startswith("equal: ")


@pytest.mark.slow
def test_the_first_difference_is_said_and_is_the_exit_status(
    command: Callable[..., Any], recording: Path
) -> None:
    ended = command("replay", recording, "--set", "controller.yaw.kp=0.8", "--json")
    said = json.loads(ended.out)
    first = said["first_difference"]
    assert ended.status == Status.MODEL_ERROR
    assert (said["differences"] > 0, said["equal"], said["settings_changed"]) == (True, False, True)
    assert (first["port"], first["state"]["field"]) == ("controller.forces", "controller.yaw.gains")
    assert command("replay", recording, "--set", "imu.sample_hz=250").status == Status.OK


@pytest.mark.slow
def test_a_truncated_recording_is_compared_and_no_proof(
    command: Callable[..., Any], recording: Path
) -> None:
    recording.write_bytes(recording.read_bytes()[:-20])
    assert read_recording(recording).is_cut
    ended = command("replay", recording, "--json")
    said = json.loads(ended.out)
    assert ended.status == Status.MODEL_ERROR
    assert (said["differences"], said["equal"]) == (0, False)
    assert said["events"] > 0
    assert "ends before" in said["fault"]


@pytest.mark.slow
def test_a_recording_of_another_board_and_no_recording_are_refused(
    command: Callable[..., Any], recording: Path, tmp_path: Path
) -> None:
    assert command("replay", recording, "detective").status == Status.BAD_INPUT
    other = tmp_path / "other"
    other.write_text("no recording")
    assert command("replay", other).status == Status.BAD_INPUT
    assert command("replay", tmp_path / "absent").status == Status.BAD_INPUT


@pytest.mark.parametrize("words", [("--for", "1"), ("--events", "x.ev")])
def test_a_recording_that_cannot_be_made_is_refused(
    command: Callable[..., Any], tmp_path: Path, words: tuple[str, ...]
) -> None:
    board = "detective" if "--events" in words else "tachobot"
    doubles = () if "--events" in words else ("--doubles", "--clock", "virtual")
    path = tmp_path / "absent" / "flight.recording"
    ended = command("run", board, *doubles, *words, "--record", path)
    assert ended.status == Status.BAD_INPUT


VERSIONS = "firmware_runtime.recording.versions.versions_here"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["whole", "part"])
def test_another_python_and_another_package_are_said(
    command: Callable[..., Any],
    recording: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    kind: str,
) -> None:
    run = recording if kind == "part" else record(tmp_path / "whole.recording", "tachobot", 0.1)
    assert json.loads(command("replay", run, "--json").out)["versions_changed"] == {}
    here = versions_here()
    others = {**here, "python": "CPython 3.99.0", "numpy": None, "kernel": "Linux 99"}
    monkeypatch.setattr(VERSIONS, lambda: others)
    ended = command("replay", run, "--json")
    assert ended.status == Status.OK
    assert json.loads(ended.out)["versions_changed"] == {
        "python": {"recorded": here["python"], "here": "CPython 3.99.0"},
        "numpy": {"recorded": here["numpy"], "here": None},
    }
    assert "CPython 3.99.0" in command("replay", run).out


def test_a_stretch_that_ends_before_it_begins_is_refused(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)
    ended = command("replay", run, "--from", "0.09", "--until", "0.05")
    assert ended.status == Status.BAD_INPUT
    assert "--until 0.05: expected an instant after --from 0.09" in ended.error
