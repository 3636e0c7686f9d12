import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import pytest

from firmware_runtime.cli import main
from firmware_runtime.cli.main import VERBS


def test_boards_lists_each_board_with_its_description(command: Callable[..., Any]) -> None:
    ended = command("boards")
    assert ended.status == 0
    assert "tachobot     hovering platform" in ended.out


def test_check_adds_up_the_bus(command: Callable[..., Any]) -> None:
    ended = command("check", "tachobot")
    assert ended.status == 0
    assert "i2c1: 13.6% of its time at 400000 Hz" in ended.out
    assert "imu sample every 10 ms" in ended.out


def test_check_counts_what_the_adapter_takes(command: Callable[..., Any]) -> None:
    ended = command("check", "tachobot", "--set", "buses.i2c1.overhead_us=100")
    assert "i2c1: 15.6% of its time at 400000 Hz and 100 us a transaction" in ended.out


def test_tree_shows_the_hierarchy_without_touching_a_bus(command: Callable[..., Any]) -> None:
    ended = command("tree", "tachobot")
    assert ended.status == 0
    for name in ("tachobot", "controller", "attitude", "yaw", "thrust_pairs", "imu"):
        assert name in ended.out


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_every_command_has_help(command: Callable[..., Any], verb: str) -> None:
    ended = command(*verb.split(), "--help")
    assert ended.status == 0
    assert "usage: firmware-runtime" in ended.out


def test_without_a_command_the_usage_is_shown(command: Callable[..., Any]) -> None:
    assert command().status == 2


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version_is_printed_without_loading_a_verb(
    command: Callable[..., Any], option: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(main, "_modules", None)
    ended = command(option)
    assert (ended.status, ended.out) == (0, f"firmware-runtime {version('firmware-runtime')}\n")


@pytest.mark.slow
def test_the_package_is_the_command_too() -> None:
    module = [
        sys.executable,
        "-m",
        "firmware_runtime.cli",
        "arm",
        "tachobot",
        "--statistics",
        "none",
    ]
    ended = subprocess.run(module, capture_output=True, text=True, check=False)
    assert ended.returncode == 3
    assert "none.socket: No such file or directory; expected a run" in ended.stderr
