"""Off the robot what a run recorded outlives the login session, also of one that was killed."""

import json
import os
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.recording.blackbox import locations as persisted
from firmware_runtime.recording.blackbox.locations import find_recording, recording_of_virtual_run
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs import black_box
from tests.support.recorded import record

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, Path]:
    """A login session, and where state is kept."""
    monkeypatch.delenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", raising=False)
    monkeypatch.delenv("RUNTIME_DIRECTORY", raising=False)
    monkeypatch.setattr("firmware_runtime.statistics.paths.SYSTEM", tmp_path / "no robot")
    monkeypatch.setattr("firmware_runtime.statistics.paths._temporary", lambda: tmp_path / "none")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "session"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "home"))
    (tmp_path / "session").mkdir(mode=0o700)
    return tmp_path / "session/firmware-runtime", tmp_path / "home/firmware-runtime"


def run(span_s: float = 0.3) -> Path:
    path = recording_of_virtual_run("tachobot")
    return record(path, "tachobot", span_s)


def test_a_run_is_kept_when_it_is_over(
    folders: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    session, state = folders
    name = read_recording(run()).header.run
    (kept,) = state.rglob("*.recording")
    assert kept == state / "tachobot" / f"{name}.recording"
    assert kept.stat().st_size < 500_000
    assert main(["recordings", "list", "--json"]) == 0
    listed = [each for each in json.loads(capsys.readouterr().out) if each["run"] == name]
    assert [each["why"] for each in listed] == ["last run"]  # the copy is not listed beside it
    for each in session.iterdir():
        each.unlink()  # as at logout
    assert find_recording("tachobot") == kept
    assert main(["replay", "tachobot"]) == 0


def test_a_run_that_was_killed_is_kept_when_the_next_begins(
    folders: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as killed:
        killed.setattr(black_box, "keep", lambda *_: None)
        name = read_recording(run()).header.run
    assert list(folders[1].rglob("*.recording")) == []
    other = read_recording(run()).header.run
    found = {each.stem for each in folders[1].rglob("*.recording")}
    assert found == {name, other}


def test_the_oldest_go_where_there_are_too_many(folders: tuple[Path, Path]) -> None:
    folder = folders[1] / "tachobot"
    names = []
    for number in range(3):
        path = run()
        names.append(read_recording(path).header.run)
        for each in folder.iterdir():
            if each.stem == names[-1]:
                os.utime(each, (number, number))
    size = max(each.stat().st_size for each in folder.iterdir())
    (folder / f"{names.pop()}.recording").unlink()
    assert persisted.persist(path, folder, round(2.5 * size)) is not None
    assert {each.stem for each in folder.iterdir()} > {names[1]}
    assert len(list(folder.iterdir())) == 2


def test_a_disk_without_room_is_one_warning(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(persisted, "replace_file", fail)
    words = ["run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1"]
    assert main(words) == 0
    said = capsys.readouterr()
    assert said.err.count("warning: the recording is not kept in") == 1
    assert "recorded in " in said.out


def test_a_board_asks_for_no_more_memory_than_its_run_takes(folders: tuple[Path, Path]) -> None:
    board = ["recording.minutes=60"]
    path = recording_of_virtual_run("tachobot")
    record(path, "tachobot", 0.3, board)
    assert path.stat().st_size < 5 << 20
    elsewhere = record(folders[0].parent / "x.recording", "tachobot", 0.3, board)
    assert elsewhere.stat().st_size > 100 << 20
