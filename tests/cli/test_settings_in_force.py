"""A board's name means the settings in force on this machine, and the output says so."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board import installed as kinds
from firmware_runtime.board import registry
from firmware_runtime.board.local_settings import PLACE

pytestmark = pytest.mark.slow

SHIPPED = {name: registry.load(name).source for name in kinds.names()}


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The user's copy of TachoBot's settings, as `service install` makes it."""
    copy = tmp_path / "etc" / "tachobot.toml"
    copy.parent.mkdir()
    copy.write_text(SHIPPED["tachobot"].read_text())
    monkeypatch.setenv(PLACE, str(copy.parent))
    return copy


def change(copy: Path, before: str, after: str) -> None:
    text = copy.read_text()
    assert before in text
    copy.write_text(text.replace(before, after))


def test_check_by_name_reads_the_settings_in_force_and_says_so(
    command: Callable[..., Any], installed: Path
) -> None:
    ended = command("check", "tachobot")
    assert ended.status == 0
    assert f"{installed} is sound" in ended.out
    assert str(installed) in ended.error


def test_a_fault_in_the_settings_in_force_is_found_by_name(
    command: Callable[..., Any], installed: Path
) -> None:
    change(installed, "speed_hz = 400_000", "speed_hz = 100")
    for verb in ("check", "show", "safe-state"):
        ended = command(verb, "tachobot")
        assert ended.status == 2
        assert f"{installed}: 1 fault" in ended.error


@pytest.mark.parametrize(
    "words",
    [
        ("show", "tachobot"),
        ("show", "tachobot", "-o", "couplings.svg"),
        ("doctor", "tachobot", "--json"),
        ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "0.1"),
        ("doubles", "serve", "tachobot", "--socket", "/no/folder/socket"),
        ("probe", "--doubles", "tachobot"),
    ],
    ids=lambda words: words[0],
)
def test_every_verb_by_name_says_where_its_settings_are_from(
    command: Callable[..., Any],
    installed: Path,
    words: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = command(*words)
    assert f"tachobot has its settings from {installed}" in ended.error


def test_a_run_on_doubles_by_name_goes_by_the_settings_in_force(
    command: Callable[..., Any], installed: Path
) -> None:
    change(installed, "reference_rad = 1.0", "reference_rad = 0.25")
    ended = command("run", "tachobot", "--doubles", "--clock", "virtual", "--json")
    assert json.loads(ended.out)["result"]["yaw_rad"] == pytest.approx(0.25, abs=0.05)


def test_assignments_hold_on_top_of_the_settings_in_force(
    command: Callable[..., Any], installed: Path
) -> None:
    change(installed, "reference_rad = 1.0", "reference_rad = 0.25")
    ended = command("check", "tachobot", "--set", "buses.i2c1.speed_hz=100000")
    assert ended.status == 0
    assert "warning: i2c1" in ended.out
    assert f"{installed} is sound" in ended.out


def test_a_path_means_that_file_and_another_board_what_is_shipped(
    command: Callable[..., Any], installed: Path
) -> None:
    change(installed, "speed_hz = 400_000", "speed_hz = 100")
    by_path = command("check", SHIPPED["tachobot"])
    other = command("check", "detective")
    for ended, board in ((by_path, "tachobot"), (other, "detective")):
        assert (ended.status, ended.error) == (0, "")
        assert f"{SHIPPED[board]} is sound" in ended.out


def test_settings_of_another_board_under_this_name_are_refused(
    command: Callable[..., Any], installed: Path
) -> None:
    installed.write_text(SHIPPED["detective"].read_text())
    ended = command("check", "tachobot")
    assert ended.status == 2
    assert "expected 'tachobot'" in ended.error


def test_boards_shows_which_settings_are_in_force(
    command: Callable[..., Any], installed: Path
) -> None:
    assert f"in force on this machine: {installed}" in command("show").out
