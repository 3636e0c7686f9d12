"""`certify`: recordings replayed here and elsewhere, certificates merged, bad input refused."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.recording.file_kind import PART_MAGIC
from firmware_runtime.status import Status


@pytest.fixture
def recording(command: Callable[..., Any], tmp_path: Path) -> Path:
    path = tmp_path / "flight.recording"
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1.5", "--record", path)
    assert command(*words).status == Status.OK
    return path


@pytest.mark.slow
def test_two_interpreters_replay_a_recording_alike(
    command: Callable[..., Any], recording: Path, tmp_path: Path
) -> None:
    page = tmp_path / "certificate.html"
    ended = command("certify", recording, "--with", sys.executable, "-o", page)
    assert ended.status == Status.OK
    assert ended.out.splitlines()[-1] == f"identical: {page}"
    assert "flight.recording" in page.read_text()


@pytest.mark.slow
def test_certificates_of_machines_are_merged_into_one(
    command: Callable[..., Any], recording: Path, tmp_path: Path
) -> None:
    here, there = tmp_path / "here.json", tmp_path / "there.json"
    assert command("certify", recording, "-o", here).status == Status.OK
    of_another = json.loads(here.read_text())
    of_another["machines"][0]["machine"]["name"] = "CPython 3.13.0, aarch64, glibc 2.41"
    there.write_text(json.dumps(of_another))
    said = json.loads(command("certify", here, there, "--json").out)
    assert said["identical"]
    assert said["recordings"] == 1
    assert [len(each["findings"]) for each in said["machines"]] == [1, 1]


@pytest.mark.slow
def test_an_interpreter_that_cannot_is_named_and_a_cut_recording_is_no_proof(
    command: Callable[..., Any], recording: Path
) -> None:
    ended = command("certify", recording, "--with", "python-of-nowhere -E", "--with", "false")
    assert ended.status == Status.MODEL_ERROR
    assert "not run: python-of-nowhere -E: python-of-nowhere: no such program" in ended.out
    assert "not run: false: it ended with 1" in ended.out
    recording.write_bytes(recording.read_bytes()[:-20])
    ended = command("certify", recording)
    assert ended.status == Status.MODEL_ERROR
    assert "ends before" in ended.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("nowhere.recording",), "nowhere.recording: no file"),
        (("nowhere.json",), "nowhere.json: No such file"),
        (("empty.recording",), "empty.recording"),
        (("other.recording",), "other.recording: not a recording of a run"),
        (("empty.recording", "-o", "certificate.pdf"), ".json or .html"),
        (("other.json", "--with", "python3"), "nothing to replay"),
    ],
)
def test_bad_input_is_a_sentence(
    command: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty.recording").write_bytes(PART_MAGIC)
    Path("other.recording").write_bytes(b"something else")
    ended = command("certify", *words)
    assert ended.status == Status.BAD_INPUT
    assert said in ended.error


@pytest.mark.slow
def test_the_last_run_of_a_board_is_replayed_as_a_whole(command: Callable[..., Any]) -> None:
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1.5")
    assert command(*words).status == Status.OK
    ended = command("certify", "tachobot", "--with", sys.executable, "--json")
    said = json.loads(ended.out)
    assert ended.status == Status.OK
    assert said["identical"]
    for each in said["machines"]:
        (finding,) = each["findings"]
        assert finding["steps"] > 0
        assert finding["transfers"] > 0
        assert finding["code_changed"] == []
