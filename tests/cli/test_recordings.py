"""`recordings`: listed, kept, saved, and collected beside runs of other processes."""

import errno
import json
import os
import shutil
import signal
import subprocess
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.layout import CHUNK, PREFIX_SIZE, SECTION, Chunk, file_of
from firmware_runtime.recording.blackbox.locations import (
    find_recording,
    kept_recordings,
    recording_of_virtual_run,
)
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import STATE, Layout
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.system import atomic_file as whole_file
from tests.support.command import Command, own_process, started
from tests.support.recorded import every_section, in_chunks, record
from tests.support.waiting import PATIENCE_S, wait_until
from tests.support.written_run import WrittenRun


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where kept recordings of the detective are."""
    monkeypatch.setenv("FIRMWARE_RUNTIME_KEPT_DIRECTORY", str(tmp_path / "kept"))
    folder = tmp_path / "kept" / "detective"
    folder.mkdir(parents=True)
    return folder


@pytest.fixture
def last(kept: Path) -> Path:
    """The last run's, of 0.2 s."""
    assert kept.is_dir()
    return record(recording_of_virtual_run("detective"), "detective", 0.2)


def rows(command: Command, *words: object) -> list[dict[str, Any]]:
    ended = command("recordings", "list", *words, "--json")
    assert ended.status == 0
    found: list[dict[str, Any]] = json.loads(ended.out)
    return found


def test_without_any_that_is_said(command: Command, kept: Path) -> None:
    assert command("recordings", "list", "detective").out == "no recordings of detective\n"
    assert rows(command) == []
    assert list(kept.iterdir()) == []


def test_the_last_run_is_listed_by_its_board(command: Command, last: Path) -> None:
    (row,) = rows(command)
    assert (row["name"], row["file"], row["board"]) == ("detective", str(last), "detective")
    assert (row["from_s"], row["to_s"]) == (0.0, 0.2)
    assert (row["end"], row["why"], row["whole"]) == ("ended", "last run", True)
    assert rows(command, "detective") == [row]
    assert rows(command, "tachobot") == []


def test_one_whose_beginning_has_been_written_over_says_since_when_it_is(
    command: Command, last: Path
) -> None:
    last.write_bytes(in_chunks(last, 20))
    last.write_bytes(file_of(read_recording(last).chunks[1:]))
    (row,) = rows(command)
    assert 0 < row["from_s"] < row["to_s"] == 0.2


def test_a_kept_one_goes_by_its_name_and_says_why(command: Command, last: Path, kept: Path) -> None:
    for name in ("detective-0001", "detective-0002-crash-1", "detective-0003-guard-2"):
        shutil.copy(last, kept / f"{name}.recording")
    found = {row["name"]: row["why"] for row in rows(command, "detective")}
    assert found == {
        "detective": "last run",
        "detective-0001": "synced",
        "detective-0002-crash-1": "crash",
        "detective-0003-guard-2": "guard",
    }
    assert find_recording("detective-0002-crash-1") == kept / "detective-0002-crash-1.recording"
    last.unlink()
    assert find_recording("detective").parent == kept
    with pytest.raises(ConfigError, match="a name that `recordings list` shows"):
        find_recording("detective-0009-crash-1")


def test_what_was_kept_off_the_robot_is_looked_for_unless_one_directory_is_stated(
    kept: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    off_the_robot = tmp_path / "state" / "firmware-runtime" / "detective"
    off_the_robot.mkdir(parents=True)
    for folder in (kept, off_the_robot):
        (folder / "detective-0001.recording").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    assert [each.parent for each in kept_recordings("detective")] == [kept]
    monkeypatch.delenv("FIRMWARE_RUNTIME_STATE_DIRECTORY")
    assert [each.parent for each in kept_recordings("detective")] == [kept, off_the_robot]


def test_one_in_another_folder_goes_by_its_path(
    command: Command, last: Path, tmp_path: Path
) -> None:
    path = tmp_path / "sent" / "detective-0001.recording"
    path.parent.mkdir()
    shutil.copy(last, path)
    (row,) = rows(command, "--in", path.parent)
    assert row["name"] == str(path)


def test_how_one_that_is_cut_ended_is_unknown_and_one_that_is_none_is_a_row(
    command: Command, last: Path, kept: Path
) -> None:
    content = last.read_bytes()
    end = content.index(b"\xa6counts") - 60  # as a key; a path in it may have the word, too
    (kept / "detective-0001-crash-1.recording").write_bytes(content[:end])
    (kept / "detective-0002.recording").write_text("Dear Sir,")
    cut, letter = rows(command, "detective")[1:]
    assert (cut["end"], cut["whole"]) == ("unknown", False)
    assert "the file ends" in cut["faults"][0]
    assert "not a recording" in letter["faults"][0]
    assert (letter["from_s"], letter["to_s"], letter["bytes"]) == (0.0, 0.0, 0)
    text = command("recordings").out
    assert "detective-0002" in text


def without_its_end(path: Path) -> bytes:
    first, *_ = read_recording(path).chunks[0].contents
    contents = [each for each in every_section(path) if kind_of(each) != Kind.ENDED]
    return file_of([Chunk(1, [first, *contents])])


def test_how_one_ended_is_said_only_where_that_is_known(
    command: Command, last: Path, kept: Path, tmp_path: Path
) -> None:
    content = without_its_end(last)
    piece = tmp_path / "pieces" / "test_that_day.recording"
    piece.parent.mkdir()
    for path in (piece, kept / "detective-0001-crash-1.recording"):
        path.write_bytes(content)
    assert [row["end"] for row in rows(command, "--in", piece.parent)] == ["unknown"]
    assert [row["end"] for row in rows(command, "detective")] == ["ended", "killed"]


@pytest.mark.parametrize(
    ("state", "end"), [(RunState.RUNNING, "running"), (RunState.ENDED, "unknown")]
)
def test_a_copy_that_grows_is_of_a_run_under_way_until_its_statistics_say_more(
    command: Command, last: Path, kept: Path, state: RunState, end: str
) -> None:
    copy = kept / "detective-0001.recording"
    copy.write_bytes(without_its_end(last))
    run = WrittenRun(path=copy.with_suffix(".stats"))
    run.file.open_section()
    run.cells[STATE] = state
    run.file.close_section(run.elapsed)
    row = rows(command, "detective")[-1]
    assert (row["why"], row["end"]) == ("synced", end)


def test_keep_leaves_a_small_file_that_is_the_same_run(
    command: Command, last: Path, tmp_path: Path
) -> None:
    path = tmp_path / "sent.recording"
    assert command("recordings", "keep", "detective", "-o", path).status == 0
    assert path.stat().st_size < last.stat().st_size / 4
    ended = command("replay", path, "--json")
    assert (ended.status, json.loads(ended.out)["identical"]) == (0, True)


def test_without_o_it_is_named_as_its_run(
    command: Command, last: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (row,) = rows(command)
    assert command("recordings", "keep", last).status == 0
    (kept,) = rows(command, "--in", ".")
    assert (kept["name"], kept["why"]) == (f"{row['run']}.recording", "")


def test_recover_says_in_one_line_what_was_saved_and_what_is_lost(
    command: Command, last: Path, tmp_path: Path
) -> None:
    damaged, path = tmp_path / "damaged", tmp_path / "saved.recording"
    content = bytearray(last.read_bytes())
    used = CHUNK.unpack_from(content, PREFIX_SIZE)[1]
    header = SECTION.unpack_from(content, PREFIX_SIZE + CHUNK.size)[0]
    content[PREFIX_SIZE + (header + used) // 2] ^= 1
    damaged.write_bytes(content[: PREFIX_SIZE + used - 10])
    ended = command("recordings", "recover", damaged, "-o", path)
    (line,) = ended.out.splitlines()
    assert ended.status == 0
    assert "bytes of chunk 1 " in line
    assert "chunk 1 behind" in line
    assert command("replay", path, "--json").status in {0, 1}


def test_check_says_how_much_is_recorded(command: Command) -> None:
    said = command("check", "tachobot").out
    assert "recording: the last 10 min in " in said
    said = command("check", "tachobot", "--set", "recording.minutes=0").out
    assert "recording: none: recording.minutes is 0" in said
    said = command("check", "tachobot", "--set", "recording.minutes=1000").out
    assert "of 1000 min in 264 MiB, which is the most" in said


@pytest.mark.slow
def test_two_runs_leave_two_files_that_the_other_verbs_read(
    command: Command, tmp_path: Path
) -> None:
    folder, kept = tmp_path / "kept", tmp_path / "tachobot.stats"
    words = ["recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)]
    with started(*words) as recorder:
        assert recorder.stdout is not None
        with ExitStack() as at_failure:
            at_failure.callback(recorder.kill)
            assert "waiting for a run" in recorder.stdout.readline()
            for _ in range(2):
                run = ["run", "tachobot", "--doubles", "--for", "1", "--statistics", str(kept)]
                own_process(*run, check=True)
                said = next(line for line in recorder.stdout if "the run is over" in line)
                assert "its statistics are kept" in said
            recorder.send_signal(signal.SIGTERM)
            assert recorder.wait(PATIENCE_S) == 0
            at_failure.pop_all()
    first, second = (folder / f"tachobot-000{number}.stats" for number in (1, 2))
    assert [imu_of(read_statistics(each).as_json())["scheduled"] for each in (first, second)] == [
        101,
        101,
    ]
    merged = command("stats", "--merge", str(first), str(second), "--json")
    assert (merged.status, imu_of(json.loads(merged.out))["scheduled"]) == (0, 202)


@pytest.mark.slow
def test_of_a_run_that_is_killed_the_recording_is_kept_and_replays(
    command: Command, tmp_path: Path
) -> None:
    folder, kept = tmp_path / "kept", tmp_path / "tachobot.stats"
    words = ["recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)]
    run = ["run", "tachobot", "--doubles", "--statistics", str(kept), "--for", "600"]
    with ExitStack() as at_end:
        recorder = at_end.enter_context(started(*words))
        at_end.callback(recorder.kill)
        robot = at_end.enter_context(started(*run, stdout=subprocess.DEVNULL))
        at_end.callback(robot.kill)
        assert recorder.stdout is not None
        assert any("keeping run 1" in line for line in recorder.stdout)
        wait_until(lambda: imu_of(read_statistics(kept).as_json())["run"] > 50, "50 samples")
        robot.kill()
        said = next(line for line in recorder.stdout if "-crash-" in line)
        recorder.send_signal(signal.SIGTERM)
        assert recorder.wait(PATIENCE_S) == 0
    (crash,) = folder.glob("tachobot-0001-crash-*.recording")
    assert said.startswith(f"recorder: {crash}")
    rows = json.loads(command("recordings", "list", "--in", folder, "--json").out)
    # On a busy machine the run may have been late before: that piece is kept, too.
    found = [(row["why"], row["end"], row["whole"]) for row in rows if row["why"] != "late"]
    assert found == [
        ("crash", "killed", True),
        ("synced", "killed", True),
    ]
    for row in rows:
        replayed = command("replay", row["file"], "--json")
        assert (replayed.status, json.loads(replayed.out)["identical"]) == (0, True)


def imu_of(document: dict[str, Any]) -> dict[str, Any]:
    imu: dict[str, Any] = document["models"]["imu"]
    return imu


@pytest.mark.slow
def test_a_full_disk_is_no_bad_input_so_that_systemd_tries_again(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replace_file(_path: Path, _content: bytes, _mode: int | None = None) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(whole_file, "replace_file", replace_file)
    kept = tmp_path / "tachobot.stats"
    StatisticsFile(Layout(), {"models": {}, "conditions": {}}, kept).close_section(0)
    folder = tmp_path / "kept"
    ended = command(
        "recordings", "collect", "tachobot", "--into", str(folder), "--statistics", str(kept)
    )
    assert ended.status == 6
    assert "No space left on device" in ended.error
