"""A start that fails since a chip is missing or another one leaves a recording, and is replayed."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.blackbox.found import (
    find_recording,
    recording_of_virtual_run,
)
from firmware_runtime.blackbox.reader import read_recording
from firmware_runtime.cli.main import main
from firmware_runtime.hal.errors import HalError
from firmware_runtime.recording.of_board import board_of_table
from firmware_runtime.replay.verdict import replay
from sim_doubles.chips.mpu9250_registers import power_up
from tests.support.recorded import record

FOREIGN = "sim_doubles.chips.mpu9250.power_up"


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))
    return tmp_path / "state"


def fail_to_start(path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Start TachoBot with another chip where its IMU should be."""
    with monkeypatch.context() as patched:
        patched.setattr(FOREIGN, lambda _: power_up(0x12))
        with pytest.raises(HalError) as caught:
            record(path, "tachobot", 0.1)
    return str(caught.value)


def test_a_start_that_failed_is_replayed_as_the_last_run_of_its_board(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = fail_to_start(recording_of_virtual_run("tachobot"), monkeypatch)
    path = find_recording("tachobot")
    assert path == state / "tachobot.start.recording"
    recording = read_recording(path)
    verdict = replay(recording, board_of_table(recording.header.source, recording.header.table))
    assert verdict.is_identical
    assert (verdict.steps, verdict.failure) == (0, said)
    assert verdict.writes > 0


def test_the_run_before_it_is_still_there(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = recording_of_virtual_run("tachobot")
    record(run, "tachobot", 0.1)
    before = read_recording(run).header.run
    fail_to_start(run, monkeypatch)
    assert read_recording(run).header.run == before
    assert sorted(each.name for each in state.iterdir()) == [
        "tachobot.start.recording",
        "tachobot.virtual.recording",
    ]


def test_verbs_take_it(
    state: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    said = fail_to_start(recording_of_virtual_run("tachobot"), monkeypatch)
    ended: Callable[..., Any] = lambda *words: (main(list(words)), capsys.readouterr().out)  # noqa: E731
    status, out = ended("replay", "tachobot")
    assert (status, said in out) == (0, True)
    status, out = ended("recordings", "--json")
    (row,) = json.loads(out)
    assert (row["name"], row["why"], row["end"], row["whole"]) == (
        *("tachobot", "start", "failed"),
        True,
    )
    status, out = ended("certify", "tachobot", "--json")
    assert (status, json.loads(out)["identical"]) == (0, True)
    assert row["file"] == str(state / "tachobot.start.recording")


def test_a_start_that_cannot_be_recorded_fails_for_its_own_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    assert "WHO_AM_I" in fail_to_start(tmp_path / "file" / "tachobot.recording", monkeypatch)
