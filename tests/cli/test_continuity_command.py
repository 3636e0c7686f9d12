"""`continuity`: the JSON contract, the page, exit statuses."""

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.tachobot.attitude import Attitude

from firmware_runtime.board.registry import load
from firmware_runtime.errors import Status
from tests.support.waiting import PATIENCE_S, wait_until


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(("board", "for_s"), [("tachobot", 2), ("detective", 4)])
def test_simulation_and_embedded_are_their_replays(
    command: Callable[..., Any], tmp_path: Path, board: str, for_s: int
) -> None:
    output = tmp_path / "certificate.json"
    stages = ("--stages", "simulation", "embedded")
    ended = command("continuity", board, "--for", for_s, "-o", output, *stages)
    said = json.loads(output.read_text())
    assert ended.status == Status.OK
    assert said["board"] == board
    assert {"simulation", "embedded"} == said["stages"].keys()
    for stage in said["stages"].values():
        assert stage["events"] > 0
        assert (stage["differences"], stage["first_difference"]) == (0, None)


WORSE = "delay=20ms,jitter=15ms,loss=10%,reorder=10%,duplicate=10%,seed=3"


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(
    ("board", "stage", "words", "how"),
    [
        ("detective", "network", (), ""),
        ("detective", "remote", (), "delay=40ms,jitter=10ms,loss=2%"),
        ("tachobot", "remote", ("--impair", WORSE), "loss=10%"),
    ],
    ids=["good", "bad", "worse"],
)
def test_both_ends_of_a_network_are_their_replays(  # noqa: PLR0917 -- fixtures
    command: Callable[..., Any],
    tmp_path: Path,
    board: str,
    stage: str,
    words: tuple[str, ...],
    how: str,
) -> None:
    output = tmp_path / "certificate.json"
    ended = command("continuity", board, "--for", 3, "-o", output, "--stages", stage, *words)
    assert ended.status == Status.OK, ended
    said = json.loads(output.read_text())["stages"]
    assert said.keys() == {stage}
    assert said[stage]["ends"].keys() == {"controller", "robot"}
    assert [end["identical"] for end in said[stage]["ends"].values()] == [True, True]
    assert (said[stage]["differences"], said[stage]["first_difference"]) == (0, None)
    assert said[stage]["link"]["back"]["age_us"]["p99"] > 0
    assert how in (said[stage]["link"]["impairment"] or {"how": ""})["how"]


def test_an_impairment_that_cannot_be_read_is_refused(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    words = ("continuity", "tachobot", "-o", tmp_path / "x.json", "--impair", "loss=lots")
    assert command(*words).status == Status.BAD_INPUT


@pytest.mark.parametrize(
    "words",
    [("--link", "ros2", "--stages", "remote"), ("--impair", "loss=2%", "--stages", "network")],
)
def test_an_option_of_a_stage_that_is_left_out_is_refused(
    command: Callable[..., Any], tmp_path: Path, words: tuple[str, ...]
) -> None:
    ended = command("continuity", "tachobot", "-o", tmp_path / "x.json", *words)
    assert ended.status == Status.BAD_INPUT
    assert "which --stages leaves out" in ended.error


EXTERNAL = Attitude.external


def turned(self: Attitude, elapsed: int) -> None:
    EXTERNAL(self, elapsed)
    if self.motion is not None:
        self.motion = self.motion._replace(position=-self.motion.position)


@pytest.mark.slow
def test_code_that_acts_otherwise_is_found_and_is_the_exit_status(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Attitude, "external", turned)  # in the replay: the run is another process
    output = tmp_path / "certificate.json"
    words = ("continuity", "tachobot", "--for", 1.5, "-o", output, "--stages", "simulation")
    ended = command(*words)
    stage = json.loads(output.read_text())["stages"]["simulation"]
    assert ended.status == Status.MODEL_ERROR
    assert stage["differences"] > 0
    assert (stage["identical"], json.loads(output.read_text())["identical"]) == (False, False)
    assert stage["first_difference"]["model"].startswith("controller.")
    assert "at 0." in ended.out


@pytest.mark.slow
def test_of_a_board_without_roles_the_stages_of_one_process_are_run(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    board, output = tmp_path / "board.toml", tmp_path / "certificate.json"
    tables = Path(load("tachobot").source).read_text().split("\n[")
    board.write_text("\n[".join(each for each in tables if not each.startswith(("roles", "link"))))
    words = ("continuity", board, "--for", 1.5, "--stages", "simulation", "network", "-o", output)
    assert command(*words).status == Status.OK
    said = json.loads(output.read_text())
    assert said["stages"].keys() == {"simulation"}
    assert "no table [roles]" in said["not_run"]["network"]


@pytest.mark.parametrize("name", ["certificate", "certificate.txt", "absent/certificate.json"])
def test_a_certificate_that_cannot_be_written_is_refused_before_anything_runs(
    command: Callable[..., Any], tmp_path: Path, name: str
) -> None:
    ended = command("continuity", "tachobot", "-o", tmp_path / name)
    assert (ended.status, ended.out) == (Status.BAD_INPUT, "")


@pytest.mark.slow
def test_the_page_is_written(command: Callable[..., Any], tmp_path: Path) -> None:
    output = tmp_path / "certificate.html"
    words = ("continuity", "tachobot", "--for", 1.5, "-o", output, "--stages", "simulation")
    assert command(*words, "--keep", tmp_path / "kept").status == Status.OK
    assert command("replay", tmp_path / "kept" / "simulation.recording").status == Status.OK
    assert output.read_text().startswith("<!DOCTYPE html>")


@pytest.mark.slow
@pytest.mark.real_time
def test_a_signal_ends_the_stage_under_way_too(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    words = ["continuity", "tachobot", "--for", "600", "--stages", "network", "--keep", str(kept)]
    command = [sys.executable, "-m", "firmware_runtime.cli", *words, "-o", str(tmp_path / "x.json")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            wait_until(lambda: len(processes_with(str(kept))) >= 3, "both ends are there")
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == Status.TERMINATED
        finally:
            process.kill()
    wait_until(lambda: processes_with(str(kept)) == [], "no process of the stage is left")
    assert not (tmp_path / "x.json").exists()


@pytest.mark.slow
def test_folders_of_one_that_was_killed_go_at_the_next_start(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = tmp_path / "temporary"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    monkeypatch.setenv("TMPDIR", str(place))
    words = ["continuity", "tachobot", "--for", "2", "--stages", "simulation"]
    command_ = [
        sys.executable,
        "-m",
        "firmware_runtime.cli",
        *words,
        "-o",
        str(tmp_path / "x.json"),
    ]
    with subprocess.Popen(
        command_, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        wait_until(lambda: len(list(place.iterdir())) == 2, "recordings and state have a place")
        process.kill()
    left = set(place.iterdir())
    assert left
    ended = command(*words, "-o", tmp_path / "y.json")
    assert ended.status == Status.OK, ended
    assert left.isdisjoint(place.iterdir())


def processes_with(word: str) -> list[str]:
    """The command lines of processes that hold this word."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            line = path.read_bytes().replace(b"\0", b" ").decode(errors="replace")
            if word in line:
                found.append(line)
    return found
