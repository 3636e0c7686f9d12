"""`doubles replay`: a recorded bus in a process of its own, for a run that knows nothing of it."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.wire_errors import BusFault
from firmware_runtime.recording.blackbox.reader import read_recording
from sim_doubles.recorded.traffic import traffic_of
from tests.support.recorded import record
from tests.support.waiting import PATIENCE_S

Command = Callable[..., Any]


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["nowhere"], "no run of a board of this name has left a recording"),
        (["{letter}"], "not a recording of a run"),
        (["{letter}", "--from", "-1"], "expected a second of the run, 0 or more"),
    ],
)
def test_a_wrong_run_or_word_is_one_sentence(
    command: Command, tmp_path: Path, words: list[str], what: str
) -> None:
    letter = tmp_path / "letter.recording"
    letter.write_text("Dear Sir,")
    given = [each.format(letter=letter) for each in words]
    ended = command("doubles", "replay", *given, "--socket", tmp_path / "doubles")
    assert (ended.status, ended.out) == (2, "")
    assert what in ended.error
    assert not (tmp_path / "doubles").exists()


@contextmanager
def replaying(folder: Path, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """Serve a recording of a TachoBot at `folder`/doubles."""
    run, socket = str(folder / "run"), str(folder / "doubles")
    line = [sys.executable, "-m", "firmware_runtime.cli", "doubles", "replay", run, *words]
    with subprocess.Popen(
        [*line, "--socket", socket, "--log", str(folder / "log")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline().startswith("replaying tachobot-")
            yield server
        finally:
            server.kill()


def events(folder: Path, what: str) -> list[dict[str, Any]]:
    lines = [json.loads(each) for each in (folder / "log").read_text().splitlines()]
    return [each for each in lines if each["event"] == what]


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_when_nobody_comes(tmp_path: Path) -> None:
    record(tmp_path / "run", "tachobot", 0.1)
    with replaying(tmp_path, "--wait", "0.2") as server:
        _, said = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 1
    assert "ended before transaction 1 of " in said
    assert not (tmp_path / "doubles").exists()


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_waits_for_doubles_that_are_served_a_moment_later(
    command: Command, tmp_path: Path
) -> None:
    socket = tmp_path / "doubles"
    line = [sys.executable, "-m", "firmware_runtime.cli", "doubles", "serve", "tachobot"]
    with subprocess.Popen([*line, "--socket", str(socket)], stdout=subprocess.DEVNULL) as server:
        try:
            ended = command("run", "tachobot", "--doubles", socket, "--for", "0.1")
        finally:
            server.terminate()
    assert "no doubles are served" not in ended.error


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_well_when_all_was_asked_for_and_the_last_has_gone(tmp_path: Path) -> None:
    recording = read_recording(record(tmp_path / "run", "tachobot", 0.1))
    with replaying(tmp_path) as server:
        connection = Connection(tmp_path / "doubles", answer_s=PATIENCE_S)
        bus = ServedBus("i2c1", connection.ask)
        for each in traffic_of(recording, [], 0).lines["i2c1"]:
            assert bus.transaction(each.transfer.address, each.transfer.messages) == (
                each.transfer.answer
            )
        connection.close()
        out, error = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 0
    assert (error, "all as recorded" in out) == ("", True)
    assert events(tmp_path, "stopped")[0]["deviations"] == 0
    assert not (tmp_path / "doubles").exists()


@pytest.mark.slow
@pytest.mark.real_time
def test_what_was_not_as_recorded_is_said_with_its_place_and_is_the_status(tmp_path: Path) -> None:
    record(tmp_path / "run", "tachobot", 0.1)
    with replaying(tmp_path) as server:
        connection = Connection(tmp_path / "doubles", answer_s=PATIENCE_S)
        with pytest.raises(BusFault, match="EPROTO"):
            ServedBus("i2c1", connection.ask).transaction(0x68, [b"\x00", 1])
        connection.close()
        server.terminate()
        _, error = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 1
    first, last = error.splitlines()
    assert first.startswith("transaction 1, i2c1 0x40, at ")
    assert first.endswith("recorded W 0104, asked i2c1 0x68 W 00, R 1; refused")
    assert last.startswith("ended before transaction 1 of ")
    (deviation,) = events(tmp_path, "deviation")
    assert (deviation["number"], deviation["device"]) == (1, "i2c1 0x68")


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("board", ["tachobot", "pan_tilt"])
def test_the_same_robot_on_a_socket_in_real_time_finds_its_chips_and_ends_safe(
    tmp_path: Path, board: str
) -> None:
    recording = read_recording(record(tmp_path / "run", board, 0.3))
    run = [sys.executable, "-m", "firmware_runtime.cli", "run", board, "--for", "0.3"]
    line = [sys.executable, "-m", "firmware_runtime.cli", "doubles", "replay"]
    line += [str(tmp_path / "run"), "--warn", "--socket", str(tmp_path / "doubles")]
    line += ["--log", str(tmp_path / "log")]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        try:
            assert server.stdout is not None
            server.stdout.readline()
            words = ["--doubles", str(tmp_path / "doubles")]
            ended = subprocess.run(
                [*run, *words, "--statistics", str(tmp_path / "run.stats")],
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=False,
            )
        finally:
            server.terminate()
            server.wait(PATIENCE_S)
    assert "not made safe" not in ended.stderr
    assert ended.returncode in {0, 1}, ended.stderr  # 1: a machine too busy for the robot
    probed = next(s for s in recording.segments()[0].sections() if s.kind.name == "PROBE")
    numbers = [each["number"] for each in events(tmp_path, "deviation")]
    assert all(each is None or each > len(probed.transfers) for each in numbers)
