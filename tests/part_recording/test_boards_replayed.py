"""Both boards: what their controllers did in a run, virtual or real, they do again in a replay."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from boards.tachobot.attitude import Attitude
from firmware_runtime.board.registry import load
from firmware_runtime.board.roles import ROBOT
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock, MonotonicClock, VirtualClock
from firmware_runtime.models.pid import Pid
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.part_recording.of_board import part_code, replay_of
from firmware_runtime.part_recording.recording import read_recording
from firmware_runtime.recording.code import changed_modules
from firmware_runtime.recording.of_board import board_of
from firmware_runtime.runs.recorded_run import recorded
from firmware_runtime.runs.session import Session
from tests.support.waiting import PATIENCE_S, wait_until

GROWN = 40_000
"""Bytes after which there are outputs in TachoBot's recording."""


def run(board: str, path: Path, clock: Clock, for_s: float, role: str = "controller") -> None:
    """A run on doubles, recorded."""
    said: list[str] = []
    session = Session(load(board), clock, doubles=True, statistics_path=None)
    try:
        with recorded(session, path, said.append, role) as ended:
            ended(session.run(seconds(for_s)))
    finally:
        session.close()
    assert said == []


def replayed(path: Path, *assignments: str) -> Comparison:
    recording = read_recording(path)
    board = load(recording.header.kind, assignments) if assignments else board_of(recording.header)
    return replay_of(recording, board)


@pytest.mark.slow
@pytest.mark.parametrize(("board", "for_s"), [("tachobot", 3.0), ("detective", 30.0)])
def test_a_simulation_is_replayed_to_the_bit(board: str, for_s: float, tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    run(board, path, VirtualClock(), for_s)
    comparison = replayed(path)
    assert (comparison.differences, comparison.state, comparison.fault) == (0, None, None)
    assert comparison.events > 5
    assert comparison.is_equal


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(("board", "for_s"), [("tachobot", 2.0), ("detective", 12.0)])
def test_a_run_in_real_time_is_replayed_to_the_bit(
    board: str, for_s: float, tmp_path: Path
) -> None:
    path = tmp_path / "run.recording"
    run(board, path, MonotonicClock(), for_s)
    comparison = replayed(path)
    assert (comparison.differences, comparison.state, comparison.fault) == (0, None, None)
    assert comparison.is_equal


@pytest.mark.slow
def test_a_changed_setting_is_found_with_its_field(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    run("tachobot", path, VirtualClock(), 2.0)
    comparison = replayed(path, "controller.yaw.kd=0.56")
    assert comparison.first is not None
    assert comparison.state is not None
    assert comparison.first.port == "controller.allocation.forces"
    assert comparison.state.field == "controller.yaw.gains"
    assert replayed(path, "world.seed=9").is_equal  # the plant is no part of the controller


@pytest.mark.slow
def test_changed_code_is_found_where_it_acts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.recording"
    run("tachobot", path, VirtualClock(), 2.0)
    whole = Attitude.external

    def turned(self: Attitude, elapsed: int) -> None:
        whole(self, elapsed)
        if self.motion is not None:
            self.motion = self.motion._replace(position=-self.motion.position)

    monkeypatch.setattr(Attitude, "external", turned)
    comparison = replayed(path)
    assert comparison.state is not None
    assert comparison.state.field == "controller.attitude.motion"
    assert not comparison.is_equal


def test_the_code_of_the_controller_is_known_by_module(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    run("tachobot", path, VirtualClock(), 0.2)
    recording = read_recording(path)
    code = part_code(load("tachobot"), recording.header.components)
    assert {Attitude.__module__, Pid.__module__, "boards.tachobot.controller"} <= code.keys()
    packages = {name.partition(".")[0] for name in code}
    assert packages == {"boards", "firmware_runtime"}  # no double, nothing of Python's own
    then = recording.header.code
    assert changed_modules(then, code) == []
    assert changed_modules(then, {**code, Pid.__module__: "another"}) == [Pid.__module__]


def test_a_recording_of_another_board_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    run("tachobot", path, VirtualClock(), 0.2)
    with pytest.raises(ConfigError, match="a recording of tachobot"):
        replay_of(read_recording(path), load("detective"))


def test_a_part_that_uses_its_buses_is_no_part_to_replay(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    run("tachobot", path, VirtualClock(), 0.2, ROBOT)
    comparison = replayed(path)
    assert comparison.fault is not None
    assert "bus i2c1" in comparison.fault
    assert not comparison.is_equal


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_that_is_killed_leaves_a_recording_up_to_then(tmp_path: Path) -> None:
    path = tmp_path / "run.recording"
    words = ["run", "tachobot", "--doubles", "--record", str(path), "--for", "600"]
    command = [sys.executable, "-m", "firmware_runtime.cli", *words]
    environment = os.environ | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)}
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as process:
        try:
            wait_until(lambda: path.exists() and path.stat().st_size > GROWN, "a recording grows")
        finally:
            process.send_signal(signal.SIGKILL)
            process.wait(PATIENCE_S)
    recording = read_recording(path)
    comparison = replay_of(recording, board_of(recording.header))
    assert recording.is_cut
    assert comparison.events > 0
    assert comparison.differences == 0
    assert not comparison.is_equal
