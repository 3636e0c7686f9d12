"""`tune`: gains printed, written to a copy, and refused where no board may be tuned."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.registry import load
from firmware_runtime.errors import Status
from firmware_runtime.lab.tuning import search

PLANT = "inertia_kg_m2=0.15,damping_nms=0.02,delay_s=0.03"


@pytest.mark.slow
def test_gains_for_a_stated_plant_are_written_to_a_copy(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    copy = tmp_path / "tuned.toml"
    ended = command("tune", "tachobot", "--plant", PLANT, "--json", "-o", copy)
    assert (ended.status, ended.error) == (Status.OK, "")
    found = json.loads(ended.out)
    assert found["margins"]["gain_db"] >= 6.0
    assert found["margins"]["phase_deg"] >= 45.0
    assert found["unseen"]["better"] >= 0.9 * found["unseen"]["runs"]
    yaw = load(str(copy)).settings.controller.yaw
    written = {f"controller.yaw.{name}": getattr(yaw, name) for name in ("kp", "ki", "kd")}
    assert written == found["gains"]


@pytest.mark.slow
def test_what_was_found_is_shown_as_a_table(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    shown = command("tune", "tachobot", "--plant", PLANT).out
    assert "phase margin, deg" in shown
    assert "runs that were not searched on" in shown


@pytest.mark.slow
def test_a_plant_that_is_not_named_is_that_of_the_settings(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(search, "_GENERATIONS", 1)
    ended = command(
        "tune", "tachobot", "--set", "world.yaw_inertia_kg_m2=0.15", "--plant", "--json"
    )
    assert (ended.status, ended.error) == (Status.OK, "")
    found = json.loads(ended.out)
    assert found["plant"]["inertia_kg_m2"] == 0.15
    assert found["plant"]["delay_s"] == 0.01
    assert found["margins"]["gain_db"] >= 6.0


@pytest.mark.parametrize("board", ["detective", "balancing", "pan_tilt"])
def test_a_board_without_a_plant_says_so_in_a_sentence(
    command: Callable[..., Any], board: str
) -> None:
    ended = command("tune", board, "--plant", PLANT)
    assert ended.status == Status.BAD_INPUT
    assert "names no plant" in ended.error


def test_the_boards_own_file_is_refused_before_anything_is_searched(
    command: Callable[..., Any],
) -> None:
    own = shipped_file("tachobot")
    before = own.read_bytes()
    ended = command("tune", "tachobot", "--plant", PLANT, "-o", own)
    assert ended.status == Status.BAD_INPUT
    assert "tachobot itself" in ended.error
    assert own.read_bytes() == before


@pytest.mark.parametrize(
    "words", [[], ["--plant", "x=1"], ["--plant", PLANT, "--from", "x"], ["--from", "nowhere"]]
)
def test_what_is_no_plant_is_bad_input(command: Callable[..., Any], words: list[str]) -> None:
    assert command("tune", "tachobot", *words).status == Status.BAD_INPUT
