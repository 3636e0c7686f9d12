"""Settings that a run was recorded with, and that the code of today refuses."""

from pathlib import Path
from tempfile import gettempdir

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import (
    board_of_table,
    changed_board,
    settings_said,
)
from tests.support.recorded import record


def test_a_key_that_the_code_no_longer_has_is_named_with_the_run_and_not_with_a_passing_file() -> (
    None
):
    board = registry.load("tachobot")
    table = {**board.table, "wings": 2}
    with pytest.raises(ConfigError) as refusal:
        board_of_table(str(board.source), table)
    assert refusal.value.where == "settings of the recorded run, by this code"
    assert refusal.value.faults[0].startswith("wings: unknown key")
    assert gettempdir() not in str(refusal.value)


def test_a_key_that_came_after_the_run_is_as_shipped_and_the_others_as_in_the_run(
    tmp_path: Path,
) -> None:
    path = record(tmp_path / "run.recording", "tachobot", 0.01, ["controller.yaw.ki=0.5"])
    header = read_recording(path).header
    shipped = registry.load("tachobot").table["controller"]["yaw"]
    del header.table["controller"]["yaw"]["kd"], header.table["controller"]["mode"]
    board = changed_board(header, ["controller.yaw.kp=0.25"])
    yaw = board.table["controller"]["yaw"]
    assert (yaw["kp"], yaw["ki"], yaw["kd"]) == (0.25, 0.5, shipped["kd"])
    header.table["wings"] = 2
    with pytest.raises(ConfigError, match="wings: unknown key"):
        changed_board(header, ())


def test_settings_are_said_with_both_values_and_many_in_short() -> None:
    assert settings_said({}) == "no setting differs from the run's"
    one: dict[str, dict[str, object]] = {"imu.name": {"recorded": "a" * 100, "tried": None}}
    assert settings_said(one) == f'imu.name=none (in the run "{"a" * 79}...)'
    many = {f"x.{number}": {"recorded": 1, "tried": 2.5} for number in range(15)}
    said = settings_said(many)
    assert said.startswith("x.0=2.5 (in the run 1), x.1=")
    assert said.endswith(", 3 more (--json has them all)")
