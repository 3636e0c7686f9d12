"""What a run keeps: its statistics, its recording, and its steps recorded or not."""

import json
import os
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from msgspec.structs import asdict, replace

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.wire_errors import BusFault
from firmware_runtime.recording.blackbox import locations as persisted
from firmware_runtime.recording.blackbox.layout import size_for
from firmware_runtime.recording.blackbox.locations import find_recording, recording_of_virtual_run
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs import black_box
from firmware_runtime.runs.local_robot import SwitchingOff
from firmware_runtime.runs.outputs import kept_settings
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.watched_run import WatchedRun, keep_clear_of_other_runs
from firmware_runtime.statistics.file_header import STATISTICS, RunState
from firmware_runtime.statistics.layout import STATE, Layout
from firmware_runtime.system.this_process import ProcessIdentity, this_process
from tests.support.command import Command
from tests.support.recorded import record

ON_CHIPS = {"switched_off": ["here: 00"]}


def another() -> ProcessIdentity:
    """A process that goes on for as long as this one: its parent."""
    pid = os.getppid()
    started = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    return replace(this_process(), pid=pid, started_ticks=int(started))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "rover.stats"


def leave(
    path: Path, writer: ProcessIdentity, conditions: dict[str, list[str]], state: RunState
) -> None:
    """Statistics that a process has left there, or is writing."""
    cells = memoryview(bytearray(8 * Layout().cells)).cast("q")
    cells[STATE] = state
    header = {"writer": asdict(writer), "conditions": conditions}
    path.write_bytes(STATISTICS.encode(header, len(cells)) + bytes(cells))


@pytest.mark.parametrize(
    ("conditions", "what"),
    [(ON_CHIPS, "drives a robot"), ({}, "is a run")],
    ids=["on chips", "on doubles of its own"],
)
def test_the_statistics_of_a_run_that_goes_on_are_not_taken(
    path: Path, conditions: dict[str, list[str]], what: str
) -> None:
    leave(path, another(), conditions, RunState.RUNNING)
    with pytest.raises(StatisticsFileError, match=f"process {os.getppid()} {what} and keeps"):
        keep_clear_of_other_runs(path)


@pytest.mark.parametrize(
    ("writer", "state"),
    [
        (another(), RunState.ENDED),
        (replace(another(), started_ticks=1), RunState.RUNNING),
        (this_process(), RunState.RUNNING),
    ],
    ids=["over", "killed", "its own"],
)
def test_others_are_replaced(path: Path, writer: ProcessIdentity, state: RunState) -> None:
    leave(path, writer, {}, state)
    assert keep_clear_of_other_runs(path) is None


def test_a_process_with_the_number_of_one_that_was_killed_is_not_watched_for_it(path: Path) -> None:
    leave(path, replace(another(), started_ticks=1), ON_CHIPS, RunState.RUNNING)
    assert WatchedRun(path).has_ended


def test_settings_are_kept_for_as_long_as_outputs_may_be_on(path: Path) -> None:
    """The guard and `safe-state` switch off by them, whatever the board's file has become."""
    failing = ["i2c1 0x40: no acknowledge"]
    hardware: Any = SimpleNamespace(is_outside=True, enable=lambda *, enabled: enabled)
    edge: Any = SimpleNamespace(section=nullcontext)
    robot: Any = SimpleNamespace(make_safe=lambda: list(failing))
    path = path.with_name("of") / "mine" / "rover.stats"
    off = SwitchingOff(board_in_force("tachobot", ()), hardware, edge, path)
    off.keep_settings()
    assert off.all_of(robot) == failing
    off.forget_settings()
    assert kept_settings(path) is not None
    failing.clear()
    assert off.before_a_run(robot) == []
    off.forget_settings()
    assert kept_settings(path) is None


@pytest.mark.parametrize("failing", [[], ["output_enable: line 17 cannot be set"]])
def test_a_line_switches_all_off_before_chips_are_written_to_which_they_are_whatever_it_does(
    failing: list[str],
) -> None:
    done: list[object] = []

    def enable(*, enabled: bool) -> None:
        done.append(enabled)
        if failing:
            raise BusFault(failing[0])

    def make_safe() -> list[str]:
        done.append("chips")
        return []

    hardware: Any = SimpleNamespace(is_outside=True, enable=enable)
    edge: Any = SimpleNamespace(section=nullcontext)
    robot: Any = SimpleNamespace(make_safe=make_safe)
    off = SwitchingOff(board_in_force("tachobot", ()), hardware, edge, None)
    assert off.all_of(robot) == failing
    assert done == [False, "chips"]


def test_a_folder_in_the_place_of_statistics_is_refused_and_not_said_to_be_replaced(
    path: Path,
) -> None:
    path.mkdir()
    with pytest.raises(StatisticsFileError, match="no regular file; expected a place to write"):
        keep_clear_of_other_runs(path)


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_each_model_is_activated_as_often(tmp_path: Path, board: str) -> None:
    def activations(recording: Path | None) -> dict[str, tuple[int, int]]:
        session = start_session(
            board_in_force(board, ()),
            VirtualClock(),
            doubles=True,
            statistics_path=None,
            recording=recording,
        )
        try:
            session.run(3 * SECOND)
        finally:
            session.close()
        figures = session.executive.statistics.figures()
        return {name: (each.run, each.reactions) for name, each in figures.models.items()}

    bare = activations(None)
    assert bare == activations(tmp_path / "run.recording")
    assert sum(run + reactions for run, reactions in bare.values()) > 100


def test_a_recording_that_was_removed_is_not_said_to_be_there(tmp_path: Path) -> None:
    recording = tmp_path / "run.recording"
    session = start_session(
        board_in_force("tachobot", ()),
        VirtualClock(),
        doubles=True,
        statistics_path=None,
        recording=recording,
    )
    session.run(SECOND // 10)
    assert session.edge.said == str(recording)
    recording.unlink()
    assert session.edge.said == f"{recording}, which has been removed since"
    session.close()


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


@pytest.mark.slow
def test_a_run_is_kept_when_it_is_over(folders: tuple[Path, Path], command: Command) -> None:
    session, state = folders
    name = read_recording(run()).header.run
    (kept,) = state.rglob("*.recording")
    assert kept == state / "tachobot" / f"{name}.recording"
    assert kept.stat().st_size < 500_000
    listed = [
        each
        for each in json.loads(command.said("recordings", "list", "--json"))
        if each["run"] == name
    ]
    assert [each["why"] for each in listed] == ["last run"]  # the copy is not listed beside it
    for each in session.iterdir():
        each.unlink()  # as at logout
    assert find_recording("tachobot") == kept
    assert command("replay", "tachobot").status == 0


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
def test_a_board_asks_for_no_more_memory_than_its_run_takes(folders: tuple[Path, Path]) -> None:
    board = ["recording.minutes=60"]
    path = recording_of_virtual_run("tachobot")
    record(path, "tachobot", 0.3, board)
    assert path.stat().st_size < 5 << 20
    elsewhere = record(folders[0].parent / "x.recording", "tachobot", 0.3, board)
    assert elsewhere.stat().st_size > 100 << 20


def stop(session: Session) -> None:
    """End its run after the first step."""
    session.executive.request_stop("over")


def test_a_run_of_one_step_is_kept_where_the_least_is(folders: tuple[Path, Path]) -> None:
    path = recording_of_virtual_run("tachobot")
    record(path, "tachobot", 60.0, ["recording.keep_mib=1"], stop)
    [kept] = folders[1].rglob("*.recording")
    assert kept.stem == read_recording(path).header.run


def test_a_run_of_a_minute_asks_for_the_memory_of_some_minutes() -> None:
    path = recording_of_virtual_run("tachobot")

    record(path, "tachobot", 60.0, ["recording.minutes=60"], stop)
    loads = board_in_force("tachobot", ()).loads.values()
    assert size_for(loads, 1).bytes < path.stat().st_size < size_for(loads, 10).bytes
