"""`run --record` and `replay`: identical, or the first difference; other files are refused."""

import json
from pathlib import Path
from threading import Lock
from typing import Any

import pytest
from firmware_boards.tachobot.allocation import Allocation

from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.local_settings import PLACE, board_in_force
from firmware_runtime.cli import replayed_run
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import Status
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox.layout import Chunk, file_of
from firmware_runtime.recording.blackbox.locations import recording_of_virtual_run
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.blackbox.state import keyframes
from firmware_runtime.runs.start import start_session
from firmware_runtime.system.conditions import versions_here
from tests.support.command import Command
from tests.support.recorded import record


@pytest.fixture
def recording(command: Command, tmp_path: Path) -> Path:
    path = tmp_path / "flight.recording"
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1.5", "--record", path)
    ended = command(*words)
    assert (ended.status, ended.error) == (Status.OK, "")
    return path


@pytest.mark.slow
def test_a_run_is_identical_to_its_replay(command: Command, recording: Path) -> None:
    ended = command("replay", recording)
    assert ended.status == Status.OK
    assert ended.out.startswith("identical: ")
    header = read_recording(recording).header
    assert (header.role, header.board) == (None, "tachobot")


@pytest.mark.slow
def test_what_record_keeps_is_the_recording_that_the_run_leaves(
    command: Command, recording: Path
) -> None:
    """Without the part of its memory that is not in use; the last run goes by its board's name."""
    left = read_recording(recording_of_virtual_run("tachobot"))
    kept = read_recording(recording)
    assert (kept.header, kept.chunks) == (left.header, left.chunks)
    assert recording.stat().st_size < 1 << 20 < left.path.stat().st_size
    assert command("replay", "tachobot").status == Status.OK


@pytest.mark.slow
def test_the_first_line_names_the_settings_that_are_not_those_of_the_run(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path / "run.recording", "tachobot", 1, ["controller.yaw.kp=0.7"])
    copy = shipped_file("tachobot").read_text().replace("kp = 0.75", "kp = 0.9")
    (tmp_path / "tachobot.toml").write_text(copy)
    monkeypatch.setenv(PLACE, str(tmp_path))
    first, *_ = command("replay", path, "tachobot").out.splitlines()
    assert first.startswith("what if: ")
    assert "controller.yaw.kp=0.9 (in the run 0.7)" in first
    # without BOARD the others are those of the run, not those in force
    first, *_ = command("replay", path, "--set", "controller.yaw.ki=0.5").out.splitlines()
    assert first == "what if: controller.yaw.ki=0.5 (in the run 0.01)"
    first, *_ = command("replay", path, "--set", "controller.yaw.kp=0.7").out.splitlines()
    assert first == "what if: no setting differs from the run's"


@pytest.mark.slow
def test_a_recording_of_another_board_and_no_recording_are_refused(
    command: Command, recording: Path, tmp_path: Path
) -> None:
    assert command("replay", recording, "detective").status == Status.BAD_INPUT
    other = tmp_path / "other"
    other.write_text("no recording")
    assert command("replay", other).status == Status.BAD_INPUT
    assert command("replay", tmp_path / "absent").status == Status.BAD_INPUT


def test_where_nothing_is_recorded_no_file_is_promised(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    words = ("run", "tachobot", "--record", path)
    link = ("--role", "controller", "--link", f"unix:{tmp_path / 'link'}", "--loop")
    ended = command(*words, *link)
    assert (ended.status, path.exists()) == (Status.BAD_INPUT, False)
    assert "expected it without --record" in ended.error
    briefly = ("--doubles", "--clock", "virtual", "--for", "0.9", "--set", "recording.minutes=0")
    ended = command(*words, *briefly)
    assert (ended.status, path.exists()) == (Status.NOT_PRINTED, False)
    assert f"--record {path}: nothing of this run was recorded" in ended.error


VERSIONS = "firmware_runtime.recording.recorded_board.versions_here"


def test_another_python_and_another_package_are_said(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)
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


def test_a_stretch_that_ends_before_it_begins_is_refused(command: Command, tmp_path: Path) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)
    assert "--until 0.05: expected an instant after --from 0.09" in command.refused(
        "replay", run, "--from", "0.09", "--until", "0.05"
    )


def test_a_run_with_nothing_to_run_again_says_so_in_json_too(
    command: Command, tmp_path: Path
) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)
    header, build, *_ = read_recording(run).chunks[0].contents
    run.write_bytes(file_of([Chunk(1, [header, build])]))
    ended = command("replay", run, "--json")
    said = json.loads(ended.out)
    assert (ended.status, said["identical"]) == (Status.MODEL_ERROR, False)
    assert "no step and no transfer is in it" in said["reason"]
    assert said["reason"] in command("replay", run).out


def test_a_stretch_without_a_keyframe_before_it_begins_at_the_start_and_says_why(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build = Allocation.__init__

    def built(self: Allocation, *arguments: Any) -> None:  # noqa: ANN401
        build(self, *arguments)
        self.waiting = {Lock(), Lock()}  # type: ignore[attr-defined]

    monkeypatch.setattr(Allocation, "__init__", built)
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)
    why = read_recording(run).no_keyframe()
    assert why is not None
    for words in (), ("--set", "controller.yaw.kp=0.8"):
        said = json.loads(command("replay", run, "--from", "0.05", "--json", *words).out)
        assert "start of the run: no keyframe is before 0.05 s" in said["began_earlier"]
        assert why in said["began_earlier"]
        assert said["began_earlier"] in command("replay", run, "--from", "0.05", *words).out
        whole = json.loads(command("replay", run, "--json", *words).out)
        assert whole["began_earlier"] is None


@pytest.mark.slow
def test_a_stretch_that_begins_at_a_keyframe_says_nothing_of_it(
    command: Command, tmp_path: Path
) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 5.2)
    said = json.loads(command("replay", run, "--from", "5.1", "--json").out)
    assert (said["identical"], said["reason"], said["began_earlier"]) == (True, None, None)
    assert said["duration_s"] < 5


def test_a_state_that_there_is_no_memory_for_is_no_difference(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = record(tmp_path / "whole.recording", "tachobot", 0.1)

    def pack(_: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(keyframes, "pack", pack)
    ended = command("replay", run)
    assert (ended.status, ended.out) == (Status.MODEL_ERROR, "")
    assert "Cannot allocate memory; expected more" in ended.error
    assert len(ended.error.splitlines()) == 1


def test_a_run_without_memory_for_a_keyframe_goes_on_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def pack(_: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr(keyframes, "pack", pack)
    found = read_recording(record(tmp_path / "whole.recording", "tachobot", 0.1))
    assert found.no_keyframe() == "MemoryError"


@pytest.mark.slow
def test_a_speed_is_kept_from_the_first_step_to_the_end_of_the_stretch(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    naps: list[float] = []
    monkeypatch.setattr(replayed_run, "monotonic_ns", lambda: 0)
    monkeypatch.setattr(replayed_run, "sleep", naps.append)
    path = record(tmp_path / "run.recording", "tachobot", 0.5)
    assert command("replay", path, "--speed", "2", "--until", "0.2").status == Status.OK
    assert naps == sorted(naps)
    assert (naps[0], naps[-1]) == (0.0, 0.1)


@pytest.mark.real_time
def test_before_the_run_is_before_any_stretch_of_it(command: Command, tmp_path: Path) -> None:
    """A real clock counts from elsewhere while chips are found; that is no instant of the run."""
    path = tmp_path / "run.recording"
    board = board_in_force("tachobot", ("executive.fifo_priority=0",))
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=None, recording=path
    )
    try:
        session.run(SECOND // 20)
    finally:
        session.close()
    said = json.loads(command("replay", path, "--until", "0.00001", "--json").out)
    assert (said["identical"], said["steps"], said["transfers"]) == (True, 1, 8)
    assert read_recording(path).segments()[0].first_at == 0
    probed = [
        each for each in read_recording(path).segments()[0].sections() if each.kind is Kind.PROBE
    ]
    assert [(each.at, {one.at for one in each.transfers}) for each in probed] == [(0, {0})]
