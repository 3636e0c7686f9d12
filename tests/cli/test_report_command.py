"""`report`: from a board's last run, from any file, and in one sentence where it cannot."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.statistics.file import save
from firmware_runtime.statistics.file_header import RunState
from tests.support.written_run import WrittenRun, uneven_run

Command = Callable[..., Any]


@pytest.fixture
def kept(state_directory: Path) -> Path:
    """The statistics of a run of the board `robot`, which is over."""
    state_directory.mkdir()
    path = state_directory / "robot.stats"
    save(uneven_run(20).statistics(RunState.ENDED), path)
    return path


@pytest.mark.parametrize("words", [[], ["robot"], ["{kept}"]])
def test_a_run_is_found_as_the_last_by_its_board_and_by_its_file(
    command: Command, kept: Path, tmp_path: Path, words: list[str]
) -> None:
    output = tmp_path / "report.html"
    ended = command("report", *(word.format(kept=kept) for word in words), "-o", output)
    assert (ended.status, ended.out, ended.error) == (0, f"{output}\n", "")
    assert "<h1>robot: timing report</h1>" in output.read_text()


def test_the_page_has_the_line_that_stats_begins_with(
    command: Command, kept: Path, tmp_path: Path
) -> None:
    output = tmp_path / "report.html"
    headline = command("stats", "--statistics", kept).out.splitlines()[0]
    command("report", kept, "-o", output)
    assert f"<code>{headline}</code>" in output.read_text()


def test_equal_files_make_equal_pages(command: Command, kept: Path, tmp_path: Path) -> None:
    pages = [tmp_path / "one.html", tmp_path / "two.html"]
    for output in pages:
        command("report", kept, "-o", output)
    assert pages[0].read_bytes() == pages[1].read_bytes()


def test_a_run_under_way_is_read_without_being_changed(
    command: Command, tmp_path: Path, state_directory: Path
) -> None:
    state_directory.mkdir()
    path = state_directory / "robot.stats"
    run = WrittenRun(path=path)
    run.activation(0, 1000, 1000)
    before = path.read_bytes()
    assert command("report", "-o", tmp_path / "report.html").status == 0
    assert path.read_bytes() == before
    assert "The run was under way" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_a_robot_s_virtual_run_has_a_page(command: Command, tmp_path: Path, board: str) -> None:
    kept, output = tmp_path / "run.stats", tmp_path / "report.html"
    run = ("run", board, "--doubles", "--clock", "virtual", "--for", 2, "--json")
    assert command(*run, "--statistics", kept).status == 0
    assert command("report", kept, "-o", output).status == 0
    assert "It ran in virtual time, in which nothing is ever late." in output.read_text()


def test_several_runs_added_up_have_a_page(command: Command, kept: Path, tmp_path: Path) -> None:
    both, output = tmp_path / "both.stats", tmp_path / "report.html"
    assert command("stats", "--merge", kept, kept, "--save", both).status == 0
    assert command("report", both, "-o", output).status == 0
    assert "<dd>400 of 408</dd>" in output.read_text()


def test_what_cannot_be_read_or_written_is_said_in_a_sentence(
    command: Command, kept: Path, tmp_path: Path
) -> None:
    output = tmp_path / "report.html"
    nosuch = command("report", "nosuch", "-o", output)
    assert (nosuch.status, nosuch.out) == (2, "")
    assert "no statistics of nosuch" in nosuch.error
    nowhere = command("report", kept, "-o", tmp_path / "absent" / "report.html")
    assert nowhere.status == 2
    assert "report.html: No such file or directory" in nowhere.error
    os.truncate(kept, 100)
    cut = command("report", kept, "-o", output)
    assert cut.status == 2
    assert "not a whole statistics file" in cut.error
    assert not output.exists()
