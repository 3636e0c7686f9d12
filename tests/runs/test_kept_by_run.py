"""A run does not take the place of one under way, and takes the same steps recorded or not."""

import os
from pathlib import Path

import pytest
from msgspec.structs import asdict, replace

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.start import start_session
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


@pytest.mark.parametrize(
    ("writer", "state"),
    [
        (another(), RunState.ENDED),
        (replace(another(), started_ticks=1), RunState.RUNNING),
        (this_process(), RunState.RUNNING),
    ],
    ids=["over", "killed", "its own"],
)
def test_others_are_replaced(path: Path, writer: ProcessIdentity, state: RunState) -> None:
    leave(path, writer, {}, state)
    assert keep_clear_of_other_runs(path) is None


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_each_model_is_activated_as_often(tmp_path: Path, board: str) -> None:
    def activations(recording: Path | None) -> dict[str, tuple[int, int]]:
        session = start_session(
            board_in_force(board, ()),
            VirtualClock(),
            doubles=True,
            statistics_path=None,
            recording=recording,
        )
        try:
            session.run(3 * SECOND)
        finally:
            session.close()
        figures = session.executive.statistics.figures()
        return {name: (each.run, each.reactions) for name, each in figures.models.items()}

    bare = activations(None)
    assert bare == activations(tmp_path / "run.recording")
    assert sum(run + reactions for run, reactions in bare.values()) > 100
