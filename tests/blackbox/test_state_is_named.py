"""A model whose state cannot be kept is named by `check` and as its run starts."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.recording.blackbox.section import Kind, decode
from tests.support.allocation import has_attribute
from tests.support.command import Command
from tests.support.recorded import every_section, record
from tests.support.replayed import check_identical


@pytest.fixture(name="line")
def _line() -> Iterator[socket.socket]:
    with socket.socket() as line:
        yield line


@pytest.fixture(name="holding")
def _holding(monkeypatch: pytest.MonkeyPatch, line: socket.socket) -> None:
    """Let TachoBot's allocation hold a socket."""
    has_attribute(monkeypatch, "line", lambda _: line)


@pytest.mark.usefixtures("holding")
def test_check_names_the_attribute(command: Command) -> None:
    checked = command("check", "tachobot").out
    (said,) = [each for each in checked.splitlines() if "keyframes" in each]
    assert "controller.allocation.line: a socket:socket" in said


@pytest.mark.usefixtures("holding")
def test_its_run_says_so_at_once_and_is_replayed_from_its_start(tmp_path: Path) -> None:
    said: list[str] = []
    path = record(tmp_path / "run.recording", "tachobot", 0.5, log=said.append)
    (warning,) = [each for each in said if "keyframe" in each]
    assert "controller.allocation.line" in warning
    assert Kind.KEYFRAME not in {decode(each).kind for each in every_section(path)}
    check_identical(path)


@pytest.mark.parametrize("board", ["tachobot", "detective", "balancing", "pan_tilt"])
def test_of_our_robots_every_state_can_be_kept(board: str, command: Command) -> None:
    assert "keyframes" not in command("check", board).out
