import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import pytest

from firmware_runtime.cli import main
from firmware_runtime.cli.verbs import GROUPS, VERBS


def test_show_lists_each_board_with_its_description(command: Callable[..., Any]) -> None:
    ended = command("show")
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


def test_show_has_the_hierarchy_without_touching_a_bus(command: Callable[..., Any]) -> None:
    ended = command("show", "tachobot")
    assert ended.status == 0
    for name in ("tachobot", "controller", "attitude", "yaw", "thrust_pairs", "imu"):
        assert name in ended.out


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_every_command_has_help(command: Callable[..., Any], verb: str) -> None:
    ended = command(*verb.split(), "--help")
    assert ended.status == 0
    assert "usage: firmware-runtime" in ended.out
    assert ("\nrun again:\n" in ended.out) == (verb == "")


def test_help_has_each_verb_in_its_group_in_a_line(command: Callable[..., Any]) -> None:
    groups = command("--help").out.split("\n\n")
    for group, verbs in GROUPS.items():
        (shown,) = [each.splitlines()[1:] for each in groups if each.startswith(f"{group}:\n")]
        assert [line.split()[0] for line in shown][: len(verbs)] == [*verbs]
        assert all(len(line) <= 60 for line in shown)
    assert "  probe " in command("--help").out


def test_without_a_command_it_is_said_where_they_are(command: Callable[..., Any]) -> None:
    ended = command()
    assert ended.status == 2
    assert "--help" in ended.error


def test_of_a_wrong_word_the_nearest_comes_first_and_the_list_last(
    command: Callable[..., Any],
) -> None:
    ended = command("stat", "tachobot")
    assert ended.status == 2
    assert ended.error.startswith("firmware-runtime: stat: no such command; did you mean stats? ")
    assert ended.error.endswith(", doubles, probe, try\n")


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
