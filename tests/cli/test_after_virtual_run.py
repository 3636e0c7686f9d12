"""Statistics of a board whose last run was in virtual time, and left none, are of another run."""

import os
from pathlib import Path
from time import monotonic_ns

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.locations import recording_of_virtual_run
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import STATE, Layout
from firmware_runtime.statistics.number_formats import local
from firmware_runtime.statistics.paths import default_path

BEGAN = 1_800_000_000 * SECOND
RAN = 60 * SECOND


@pytest.fixture
def real_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> StatisticsFile:
    """The statistics of a run of `tachobot` that is over."""
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    header = {
        "models": {"imu": {"period_ns": SECOND, "tolerance_ns": 1, "policy": "skip"}},
        "conditions": {"board": "tachobot"},
        "began": [monotonic_ns(), BEGAN],
    }
    file = StatisticsFile(Layout(models=("imu",)), header, default_path("tachobot"))
    file.open_section()
    file.cells[STATE] = RunState.ENDED
    file.close_section(RAN)
    return file


def virtual_run_at(date: int) -> None:
    recording = recording_of_virtual_run("tachobot")
    recording.touch()
    os.utime(recording, ns=(date, date))


def said(capsys: pytest.CaptureFixture[str], tmp_path: Path, verb: str) -> str:
    page = ["-o", str(tmp_path / "page.html")] if verb == "report" else []
    assert main([verb, "tachobot", *page]) == 0
    return capsys.readouterr().err


@pytest.mark.usefixtures("real_run")
@pytest.mark.parametrize("verb", ["stats", "report", "top"])
def test_a_newer_run_in_virtual_time_is_named_with_the_date_of_the_one_shown(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, verb: str
) -> None:
    virtual_run_at(BEGAN + RAN + SECOND)
    assert (
        "the last run of tachobot was in virtual time, which leaves no statistics without "
        f"--statistics; these are of the run before it, {local(BEGAN)}\n"
    ) in said(capsys, tmp_path, verb)


@pytest.mark.usefixtures("real_run")
def test_an_older_one_is_not(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert said(capsys, tmp_path, "stats") == ""
    virtual_run_at(BEGAN + RAN - SECOND)
    assert said(capsys, tmp_path, "stats") == ""


def test_nor_is_one_beside_a_run_under_way(
    real_run: StatisticsFile, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    real_run.cells[STATE] = RunState.RUNNING
    virtual_run_at(BEGAN + 2 * RAN)
    assert said(capsys, tmp_path, "stats") == ""


@pytest.mark.usefixtures("real_run")
def test_a_file_that_is_no_boards_is_shown_without_a_word(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    virtual_run_at(BEGAN + 2 * RAN)
    copy = tmp_path / "elsewhere.stats"
    copy.write_bytes(default_path("tachobot").read_bytes())
    assert main(["stats", "--statistics", str(copy)]) == 0
    assert capsys.readouterr().err == ""
