"""A run does not take the place of one that is under way, on chips or on doubles of its own."""

import os
from pathlib import Path

import pytest
from msgspec.structs import asdict, replace

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.runs.watched_run import keep_clear_of_other_runs
from firmware_runtime.statistics.file_header import STATISTICS, RunState
from firmware_runtime.statistics.layout import STATE, Layout
from firmware_runtime.system.this_process import ProcessIdentity, this_process

ON_CHIPS = {"switched_off": ["here: 00"]}


def another() -> ProcessIdentity:
    """A process that goes on for as long as this one: its parent."""
    pid = os.getppid()
    started = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    return replace(this_process(), pid=pid, started_ticks=int(started))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "rover.stats"


def leave(
    path: Path, writer: ProcessIdentity, conditions: dict[str, list[str]], state: RunState
) -> None:
    """Statistics that a process has left there, or is writing."""
    cells = memoryview(bytearray(8 * Layout().cells)).cast("q")
    cells[STATE] = state
    header = {"writer": asdict(writer), "conditions": conditions}
    path.write_bytes(STATISTICS.encode(header, len(cells)) + bytes(cells))


@pytest.mark.parametrize(
    ("conditions", "what"),
    [(ON_CHIPS, "drives a robot"), ({}, "is a run")],
    ids=["on chips", "on doubles of its own"],
)
def test_the_statistics_of_a_run_that_goes_on_are_not_taken(
    path: Path, conditions: dict[str, list[str]], what: str
) -> None:
    leave(path, another(), conditions, RunState.RUNNING)
    with pytest.raises(StatisticsFileError, match=f"process {os.getppid()} {what} and keeps"):
        keep_clear_of_other_runs(path)


def test_those_of_one_that_is_over_are_replaced(path: Path) -> None:
    leave(path, another(), {}, RunState.ENDED)
    assert keep_clear_of_other_runs(path) is None


def test_those_of_a_process_that_was_killed_are_replaced(path: Path) -> None:
    leave(path, replace(another(), started_ticks=1), {}, RunState.RUNNING)
    assert keep_clear_of_other_runs(path) is None


def test_its_own_are_replaced(path: Path) -> None:
    leave(path, this_process(), {}, RunState.RUNNING)
    assert keep_clear_of_other_runs(path) is None
