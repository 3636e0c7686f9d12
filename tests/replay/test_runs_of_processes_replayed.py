"""Runs as processes, with all that comes in from outside, killed ones and linked ones, replayed."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime import open_board
from firmware_runtime.board import installed as kinds
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Kind
from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.linked_runs import linked
from tests.support.replayed import check_identical
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


def run(folder: Path, *words: object, seed: int = 0) -> None:
    """A run as a process of its own, to its end."""
    places = {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(folder), "PYTHONHASHSEED": str(seed)}
    ended = subprocess.run(
        [*COMMAND, "run", *map(str, words)],
        env={**os.environ, **places},
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr


def sections(path: Path) -> list[Any]:
    return [each for part in read_recording(path).segments() for each in part.sections()]


def has_begun(run: GuardedRun, steps: int) -> None:
    wait_until(lambda: run.steps() >= steps, f"{steps} steps", run.errors)


def test_a_served_run_that_everything_enters_is_its_replay(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    shipped = kinds.shipped_file("tachobot").read_text()
    file.write_text(shipped)
    with guarded_run(tmp_path, board=str(file), guard=False) as robot:
        for words in (
            ("set", "tachobot", "controller.yaw.kp=0.7"),
            ("send", "tachobot", "yaw_reference=0.5"),
            ("doubles", "fault", "nack", "0x68", "--socket", robot.socket),
            ("disarm", "tachobot"),
        ):
            asked = robot.ask(*words)
            assert asked.returncode == 0, asked.stderr
        file.write_text(shipped.replace("kp = ", "kp = 1.5 # "))
        robot.signal(signal.SIGHUP)
        wait_until(lambda: "reloaded" in robot.errors(), "it has reloaded", robot.errors)
        robot.signal(signal.SIGTERM)
        robot.run.wait(PATIENCE_S)
    path = tmp_path / "tachobot.recording"
    check_identical(path)
    found = sections(path)
    kinds_found = [each.kind for each in found]
    assert kinds_found.count(Kind.RETUNED) == 2
    assert {each for section in found for each in section.enabled} == {True, False}
    assert any(name == "yaw_reference" for each in found for name, _ in each.entered)
    assert any(each.failed for section in found for each in section.transfers)
    assert Kind.ENDED in kinds_found


def test_a_run_that_was_killed_is_its_replay_to_the_last_whole_step(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, supervised=False) as robot:
        has_begun(robot, 50)
        robot.signal(signal.SIGKILL)
        robot.run.wait(PATIENCE_S)
    path = tmp_path / "tachobot.recording"
    assert check_identical(path, 40).duration > 0
    assert Kind.ENDED not in [each.kind for each in sections(path)]


def test_both_ends_of_a_link_are_their_replays(tmp_path: Path) -> None:
    with linked(tmp_path, "tachobot", f"unix:{tmp_path / 'link'}") as ends:
        robot = ends.robot("--for", "60")
        controller = ends.controller("--for", "60")
        for end in (robot, controller):  # the controller makes one for what comes over the link
            end.wait_until_it_has_made(steps=100)
        controller.kill()
        robot.process.terminate()
        robot.report()
    check_identical(tmp_path / "tachobot.recording")
    check_identical(tmp_path / "tachobot.controller.recording")


def test_both_ends_of_the_stage_network_are_their_replays(tmp_path: Path) -> None:
    run(tmp_path, "tachobot", "--stage", "network", "--for", 1)
    check_identical(tmp_path / "tachobot.recording")
    check_identical(tmp_path / "tachobot.controller.recording")


@pytest.mark.parametrize("mode", ["free", "track"])
def test_each_mode_in_real_time_is_its_replay(tmp_path: Path, mode: str) -> None:
    run(tmp_path, "tachobot", "--doubles", "--for", 1, "--set", f"controller.mode={mode}")
    check_identical(tmp_path / "tachobot.recording")


def test_what_else_writes_the_run_down_changes_nothing_in_its_recording(tmp_path: Path) -> None:
    words = ("--record", tmp_path / "kept", "--trace", tmp_path / "trace", "--json")
    run(tmp_path, "tachobot", "--doubles", "--for", 1, "--input", "0.5:yaw_reference=0.4", *words)
    check_identical(tmp_path / "tachobot.recording")
    check_identical(tmp_path / "kept")


def test_two_robots_of_one_kind_are_each_their_replay_whatever_the_hash_seed(
    tmp_path: Path,
) -> None:
    for seed, name in enumerate(("left", "right"), start=5):
        file = tmp_path / f"{name}.toml"
        file.write_text(f'name = "{name}"\n' + kinds.shipped_file("detective").read_text())
        run(tmp_path, file, "--doubles", "--for", 1, seed=seed)
    for name in ("left", "right"):
        path = tmp_path / f"{name}.recording"
        check_identical(path)
        assert read_recording(path).header.board == name


def test_a_run_in_stretches_with_pauses_is_its_replay(tmp_path: Path) -> None:
    with open_board("tachobot", doubles=True, statistics=tmp_path / "run.stats") as robot:
        for _ in range(3):
            robot.run(0.4)
    path = tmp_path / "run.recording"
    check_identical(path)
    assert [each.kind for each in sections(path)].count(Kind.GO_ON) == 3


def test_a_served_run_whose_outputs_go_off_in_each_pause_is_its_replay(tmp_path: Path) -> None:
    socket = tmp_path / "doubles"
    words = ("doubles", "serve", "tachobot", "--socket", str(socket))
    with subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            assert "serving tachobot" in server.stdout.readline()
            settings = {"executive.fifo_priority": 0}
            statistics = tmp_path / "run.stats"
            with open_board(
                "tachobot", doubles=socket, statistics=statistics, set=settings
            ) as robot:
                for _ in range(2):
                    robot.run(0.5)
        finally:
            server.terminate()
            server.wait(PATIENCE_S)
    check_identical(tmp_path / "run.recording")
