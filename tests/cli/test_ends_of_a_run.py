"""Ends of a run: its files, its result, an overload, signals and death."""

import errno
import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import firmware_runtime
from firmware_runtime.board.robot import Robot
from firmware_runtime.cli.commands import run
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.lab.stages import staged_run
from firmware_runtime.recording.blackbox import layout
from firmware_runtime.recording.blackbox.locations import recording_beside
from firmware_runtime.runs import black_box, open_board
from firmware_runtime.runs import kept_recordings as keeping
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.trace_file import TraceFile
from firmware_runtime.system import atomic_file
from sim_doubles.rigs.tachobot import TachobotRig
from tests.support.command import Command, own_process, started
from tests.support.waiting import PATIENCE_S, wait_until

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
        (said,) = command.refused("run", "tachobot", *(stage or BRIEFLY), option, path).splitlines()
        assert said.startswith(f"firmware-runtime: run: {option} {path}: cannot be written (")
        assert said.endswith("; expected a file that can be written")


@pytest.mark.usefixtures("nothing_is_opened")
def test_all_of_them_are_said_at_once(command: Command, tmp_path: Path) -> None:
    words = [word for each in ("--trace", "--record", "--plot") for word in (each, tmp_path)]
    assert [
        each in command.refused("run", "detective", *BRIEFLY, *words)
        for each in ("3 faults", "--trace", "--record", "--plot")
    ] == [True] * 4


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
        assert f"{place}" in command.refused("run", *words, "--statistics", place)
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
    assert "all outputs off" in ended.out.splitlines()
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
    def kept(path: Path, *_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(atomic_file, "keep_file", kept)
    drawn = ("run", "detective", "--plot", tmp_path / "run.html")
    ended, failed = command(*drawn, *BRIEFLY[:-1], "3"), command(*drawn, *BRIEFLY)
    assert (ended.status, failed.status) == (10, 1)
    for each in (ended, failed):
        assert "--plot: " in each.error
        assert "No space left on device" in each.error


RUN = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 1)


def _breaks(*_: object) -> dict[str, object]:
    raise KeyError("wheels")


def test_a_world_that_breaks_costs_its_result_and_nothing_else(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(TachobotRig, "result", _breaks)
    ended = command(*RUN)
    assert ended.status == Status.BAD_INPUT
    assert "KeyError: 'wheels'" in ended.error
    assert "all outputs off" in ended.out.splitlines()
    assert "in virtual time: no activation can be late" in ended.out.splitlines()


def test_a_robot_that_breaks_hides_no_output_that_may_be_on(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Robot, "own_result", _raises_a_sentence)
    monkeypatch.setattr(Robot, "make_safe", lambda _robot: ["i2c1 0x40: not acknowledged"])
    ended = command(*RUN, "--json")
    assert ended.status == Status.NOT_SAFE
    assert "not made safe: i2c1 0x40: not acknowledged" in ended.error
    document = json.loads(ended.out)
    assert document["result"] is None
    assert document["statistics"]["models"]["imu"]["scheduled"] > 0


def _raises_a_sentence(robot: Robot) -> dict[str, object]:
    with robot._named("result"):
        return _breaks()


def test_a_world_that_has_no_solution_is_a_model_that_failed(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends(*_: object) -> dict[str, object]:
        raise ModelError("mast.thrust: a step of 1e-10 s")

    monkeypatch.setattr(TachobotRig, "result", ends)
    ended = command(*RUN)
    assert (ended.status, "mast.thrust" in ended.error) == (Status.MODEL_ERROR, True)


PROGRAM = """
import sys
from time import sleep
from firmware_boards.tachobot.attitude import Attitude
from firmware_runtime.cli.main import main
external = Attitude.external
def slow(self, elapsed):
    sleep(0.199)
    external(self, elapsed)
Attitude.external = slow
sys.exit(main(sys.argv[1:]))
"""


def overloaded(folder: Path, *words: str) -> "subprocess.Popen[str]":
    """TachoBot on its doubles, 199 ms in one model at each of its activations, due every 10 ms."""
    statistics = ("--statistics", str(folder / "x.stats"), "--for", "600")
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "run", "tachobot", "--doubles", *statistics, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.slow
@pytest.mark.real_time
def test_it_says_so_and_its_statistics_do(tmp_path: Path) -> None:
    with overloaded(tmp_path, "--json") as run:
        assert run.stderr is not None
        assert any("overload: " in line for line in run.stderr)
        run.send_signal(signal.SIGINT)
        printed, _ = run.communicate(timeout=PATIENCE_S)
    statistics: dict[str, Any] = json.loads(printed)["statistics"]
    assert statistics["conditions"]["run"]["overloaded_s"] > 0
    assert not statistics["conditions"]["settings"]["fifo_priority"]["granted"]


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_where_the_board_says_so(tmp_path: Path) -> None:
    with overloaded(tmp_path, "--set", "executive.overload=stop") as run:
        said = run.communicate(timeout=PATIENCE_S)[1]
    assert run.returncode == 1
    assert "overload: " in said


@contextmanager
def running(*words: str) -> Iterator["subprocess.Popen[str]"]:
    """A robot that runs in real time, seen to be running."""
    run = ("run", "tachobot", "--doubles", "--for", "600", *words)
    process = started(*run, stderr=subprocess.PIPE)
    try:
        wait_until(lambda: steps() > 200 or process.poll() is not None, "its propellers turn")
        assert process.poll() is None
        yield process
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def steps() -> int:
    """How many steps the run has made; 0 before it has begun."""
    try:
        return read_statistics(default_path("tachobot")).cells[STEPS]
    except StatisticsFileError:
        return 0


def stats() -> dict[str, Any] | None:
    """What another process reads of the run, or None while there is nothing."""
    read = own_process("stats", "tachobot", "--json")
    return json.loads(read.stdout) if read.returncode == 0 else None


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGINT, 130)])
def test_a_signal_ends_the_run_with_all_outputs_off(number: signal.Signals, status: int) -> None:
    with running("--json") as process:
        process.send_signal(number)
        out, error = process.communicate(timeout=PATIENCE_S)
    document = json.loads(out)
    assert (process.returncode, error) == (status, "")
    assert document["ended"] == {"state": "stopped", "reason": number.name}
    assert document["outputs_on"] == {"thrust_pairs": 0}
    kept = stats()
    assert kept == {**document["statistics"], "takeovers": []}


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_that_a_signal_ends_says_so_in_words_and_is_no_failure() -> None:
    with running() as process:
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=PATIENCE_S)
    closing = out.split("\n\n")[-1].splitlines()
    assert error == ""
    assert closing[0].startswith("TachoBot ")
    assert re.fullmatch(r"stopped after \d+\.\d\d s: SIGINT", closing[1])
    assert "all outputs off" in closing
    assert closing[-2] == f"recorded in {recording_beside(default_path('tachobot'))}"
    assert "stats tachobot (the table)" in closing[-1]


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_is_one_thread_and_its_statistics_are_read_while_it_lives_and_after_kill_9(
    state_directory: Path,
) -> None:
    with running() as process:
        assert len(list(Path(f"/proc/{process.pid}/task").iterdir())) == 1
        during = stats()
        os.kill(process.pid, signal.SIGKILL)
        process.communicate(timeout=PATIENCE_S)
    after = stats()
    assert during is not None
    assert after is not None
    assert during["conditions"]["run"]["state"] == "running"
    assert after["conditions"]["run"]["state"] == "died"
    assert after["scheduled"] >= during["scheduled"] > 0
    assert after["scheduled"] == after["run"] + after["skipped"] + after["coalesced"]
    assert (state_directory / "tachobot.stats").is_file()
