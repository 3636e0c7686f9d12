"""Files that a run writes: refused before its chips are asked, ended once they are released."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import firmware_runtime
from firmware_runtime.cli.commands import run
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.stages import staged_run
from firmware_runtime.recording.blackbox import layout
from firmware_runtime.runs import black_box, open_board
from firmware_runtime.runs import kept_recordings as keeping
from firmware_runtime.runs import picture_of_run as plot
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.statistics.trace_file import TraceFile

Command = Callable[..., Any]
BRIEFLY = ("--doubles", "--clock", "virtual", "--for", "0.05")


@pytest.fixture
def nothing_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    """A session, or an end of a stage, that is begun fails the test."""

    def begun(*_: object, **__: object) -> None:
        raise AssertionError("hardware was opened")

    monkeypatch.setattr(run, "Session", begun)
    monkeypatch.setattr(open_board, "Session", begun)
    monkeypatch.setattr(staged_run, "EndProcess", begun)


@pytest.mark.usefixtures("nothing_is_opened")
@pytest.mark.parametrize("stage", [(), ("--stage", "network")])
@pytest.mark.parametrize("option", ["--trace", "--record"])
def test_a_file_that_cannot_be_made_is_refused_before_the_hardware_is_opened(
    command: Command, tmp_path: Path, option: str, stage: tuple[str, ...]
) -> None:
    for path in (tmp_path / "no" / "file", tmp_path):
        ended = command("run", "tachobot", *(stage or BRIEFLY), option, path)
        assert (ended.status, ended.out) == (2, "")
        (said,) = ended.error.splitlines()
        assert said.startswith(f"firmware-runtime: run: {option} {path}: cannot be written (")
        assert said.endswith("; expected a file that can be written")


@pytest.mark.usefixtures("nothing_is_opened")
def test_all_of_them_are_said_at_once(command: Command, tmp_path: Path) -> None:
    words = [word for each in ("--trace", "--record", "--plot") for word in (each, tmp_path)]
    ended = command("run", "detective", *BRIEFLY, *words)
    assert ended.status == 2
    assert [each in ended.error for each in ("3 faults", "--trace", "--record", "--plot")] == [
        True
    ] * 4


@pytest.mark.usefixtures("nothing_is_opened")
def test_a_program_is_refused_likewise(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no folder"):
        firmware_runtime.open_board("tachobot", record=tmp_path / "no" / "file")


def _noted(order: list[str], name: str, called: Callable[[Any], object]) -> Callable[[Any], object]:
    """A function that notes when it is called."""

    def noting(argument: object) -> object:
        order.append(name)
        return called(argument)

    return noting


@pytest.mark.slow
def test_they_are_ended_once_the_hardware_is_released(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    closed: list[type[Any]] = [Hardware, TraceFile]
    for each in closed:
        monkeypatch.setattr(each, "close", _noted(order, each.__name__, each.close))
    monkeypatch.setattr(keeping, "file_of", _noted(order, "recording", layout.file_of))
    trace, recording = tmp_path / "trace", tmp_path / "recording"
    words = ("--trace", trace, "--record", recording)
    command("run", "tachobot", *BRIEFLY[:-1], "3", *words)
    assert order[0] == "Hardware"
    assert sorted(order[1:]) == ["TraceFile", "recording"]
    assert command("replay", recording).status == 0
    assert trace.stat().st_size > 0


@pytest.mark.slow
@pytest.mark.real_time
def test_in_real_time_nothing_of_a_trace_is_written_while_the_run_goes_on(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    close, write = Hardware.close, TraceFile.write

    def released(hardware: Hardware) -> None:
        order.append("released")
        close(hardware)

    def written(file: TraceFile, at: int, port: str, value: object) -> None:
        order.append("written")
        write(file, at, port, value)

    monkeypatch.setattr(Hardware, "close", released)
    monkeypatch.setattr(TraceFile, "write", written)
    for index, words in enumerate(((), ("--set", "recording.minutes=0"))):
        order.clear()
        trace = tmp_path / f"trace-{index}"
        command("run", "tachobot", "--doubles", "--for", "2", "--trace", trace, *words)
        assert order[0] == "released"
        assert set(order[1:]) == {"written"}
        assert "imu.sample" in trace.read_text()


@pytest.mark.slow
@pytest.mark.real_time
def test_a_trace_of_a_run_that_could_not_be_recorded_is_not_whole(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(black_box, "encoded_header", full)
    ended = command("run", "tachobot", "--doubles", "--for", "2", "--trace", tmp_path / "trace")
    assert ended.status == 10
    assert "trace: the trace is not whole: the run could not be recorded" in ended.error


@pytest.mark.parametrize(
    "words",
    [("tachobot", *BRIEFLY), ("detective", "--events", "empty.ev")],
)
def test_statistics_take_the_place_of_no_pipe_or_device(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty.ev").touch()
    os.mkfifo("pipe")
    Path("link").symlink_to("pipe")
    for place in ("pipe", "link"):
        ended = command("run", *words, "--statistics", place)
        assert (ended.status, ended.out) == (2, "")
        assert f"{place}" in ended.error
        assert Path(place).is_fifo()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["empty.ev", "link", "pipe"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "why"),
    [
        ("--trace", "ends early (No space left on device); expected room for all of it"),
        ("--record", "cannot be kept there (no regular file); it is in "),
    ],
)
def test_a_file_that_did_not_take_everything_is_a_status_of_its_own(
    command: Command, option: str, why: str
) -> None:
    ended = command("run", "tachobot", *BRIEFLY[:-1], "3", option, "/dev/full")
    assert ended.status == 10
    assert "outputs still on: none" in ended.out
    (said,) = ended.error.splitlines()
    assert "/dev/full: the " in said
    assert why in said


@pytest.mark.slow
def test_it_hides_no_status_of_the_run(command: Command) -> None:
    ended = command("run", "tachobot", *BRIEFLY, "--trace", "/dev/full")
    assert ended.status == 1
    assert "was never ready" in ended.error


@pytest.mark.slow
def test_a_picture_that_finds_no_room_does_not_hide_how_the_run_ended(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def written(path: Path, _drawing: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(plot, "write_picture", written)
    drawn = ("run", "detective", "--plot", tmp_path / "run.svg")
    ended, failed = command(*drawn, *BRIEFLY[:-1], "3"), command(*drawn, *BRIEFLY)
    assert (ended.status, failed.status) == (10, 1)
    for each in (ended, failed):
        assert "--plot: [Errno 28] No space left on device" in each.error
