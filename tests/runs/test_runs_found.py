"""The runs that `safe-state` finds by what they have open: it takes their right, and waits."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from fcntl import LOCK_EX, flock
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.runs import safe_state as module
from firmware_runtime.runs.active_runs import is_driven
from firmware_runtime.runs.outputs import keep_settings
from firmware_runtime.runs.safe_state import BETWEEN, WATCH, SafeState
from firmware_runtime.runs.watched_run import last_safe_state, safe_state_files
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import STATISTICS, RunState
from firmware_runtime.statistics.layout import ACKNOWLEDGED, EPOCH, STATE, Layout


@pytest.fixture
def line(tmp_path: Path) -> Path:
    """What stands for the node of a bus."""
    path = tmp_path / "i2c"
    path.touch()
    return path


@pytest.fixture
def board(line: Path) -> Board:
    return registry.load("tachobot", [f"buses.i2c1.device={line}"])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture
def run(path: Path, line: Path) -> StatisticsFile:
    """The statistics of a run of this process, which drives what is on the line."""
    header = {"models": {}, "conditions": {"switched_off": [f"{line} 0x40: fd10"]}}
    return StatisticsFile(Layout(), header, path)


@contextmanager
def opened(line: Path, *more: Path, alone: bool = True) -> Iterator[int]:
    """Another process has these open, the line locked if `alone`; its number."""
    with ExitStack() as stack:
        files = [stack.enter_context(each.open("rb")) for each in (line, *more)]
        if alone:
            flock(files[0], LOCK_EX)
        kept = [file.fileno() for file in files]
        process = subprocess.Popen(["cat"], stdin=subprocess.PIPE, pass_fds=kept)
        stack.enter_context(process)
        yield process.pid


def test_the_run_that_is_expected_loses_its_right_before_any_is_looked_for(
    board: Board, path: Path, run: StatisticsFile
) -> None:
    SafeState([board], None, path).take_right()
    assert run.cells[EPOCH] < 0


def test_a_run_is_found_by_its_line_wherever_it_keeps_its_statistics(
    board: Board, line: Path, path: Path, run: StatisticsFile
) -> None:
    safe_state = SafeState([board], None, None)
    with opened(line, path):
        safe_state.find_runs()
    assert run.cells[EPOCH] < 0
    assert safe_state.statistics_found == {path}
    assert not safe_state.is_over


@pytest.mark.parametrize("what", ["of another line", "over"])
def test_a_run_that_cannot_drive_the_line_keeps_its_right(
    board: Board, line: Path, path: Path, run: StatisticsFile, what: str
) -> None:
    if what == "over":
        run.cells[STATE] = RunState.ENDED
    else:
        header = {"models": {}, "conditions": {"switched_off": [f"{line}0 0x40: fd10"]}}
        run = StatisticsFile(Layout(), header, path)
    safe_state = SafeState([board], None, path)
    safe_state.take_right()
    assert run.cells[EPOCH] == 0
    assert (safe_state.has_acknowledged(), safe_state.is_over) == (True, True)


def test_a_run_is_waited_for_until_it_knows_that_it_must_not_drive_and_that_a_person_said_so(
    board: Board, path: Path, run: StatisticsFile
) -> None:
    safe_state = SafeState([board], None, path)
    safe_state.take_right()
    assert not safe_state.has_acknowledged()
    [warning] = safe_state.warnings()
    assert warning.startswith(f"process {os.getpid()} has not acknowledged")
    run.cells[ACKNOWLEDGED] = run.cells[EPOCH]
    assert safe_state.has_acknowledged()
    assert safe_state.warnings() == []
    run.cells[EPOCH] = run.cells[ACKNOWLEDGED] = 7  # the guard has taken it since
    assert not safe_state.has_acknowledged()
    assert run.cells[EPOCH] < 0


def test_a_process_that_holds_the_line_and_keeps_no_statistics_is_named_until_it_is_gone(
    board: Board, line: Path
) -> None:
    safe_state = SafeState([board], None, None)
    with opened(line, alone=False), opened(line) as process:
        safe_state.find_runs()
        assert (safe_state.has_acknowledged(), safe_state.is_over) == (False, False)
        [warning] = safe_state.warnings()
        assert warning.startswith(f"process {process} (cat) holds ")
        assert str(line) in warning
    assert (safe_state.has_acknowledged(), safe_state.is_over) == (True, True)
    assert safe_state.warnings() == []


def test_a_run_of_another_version_is_known_by_its_statistics(
    board: Board, line: Path, path: Path
) -> None:
    path.write_bytes(STATISTICS.magic)
    safe_state = SafeState([board], None, None)
    with opened(line, path):
        safe_state.find_runs()
        assert safe_state.has_acknowledged()
        assert safe_state.warnings() == []


def test_a_run_to_come_finds_when_this_was_called_for_or_a_warning_is_given(
    board: Board, path: Path
) -> None:
    SafeState([board], None, None).warn_runs_to_come()
    safe_state = SafeState([board], None, path)
    safe_state.warn_runs_to_come()
    assert last_safe_state(safe_state_files("tachobot", path)) > 0
    assert safe_state.warnings() == []
    path.touch()
    nowhere = SafeState([board], None, path / "tachobot.stats")
    nowhere.warn_runs_to_come()
    [warning] = nowhere.warnings()
    assert "a run that is starting does not learn of this" in warning


def test_a_line_is_driven_as_long_as_it_is_locked(line: Path, tmp_path: Path) -> None:
    lines = [str(tmp_path / "gone"), str(line)]
    with line.open("rb") as held:
        flock(held, LOCK_EX)
        assert is_driven(lines)
    assert [is_driven(lines) for _ in range(2)] == [False, False]


def test_what_a_run_drives_by_other_settings_is_switched_off_too(
    board: Board, path: Path, run: StatisticsFile
) -> None:
    def buses_tried(kept: Board) -> int:
        keep_settings(kept, path)
        safe_state = SafeState([board], None, path)
        for _ in range(2):  # as long as it is looked for
            safe_state.take_right()
        return len([each for each in safe_state.make_safe() if "i2c1" in each])

    assert run.cells[EPOCH] == 0
    moved = registry.load("tachobot", ["buses.i2c1.device=/dev/i2c-none"])
    assert (buses_tried(board), buses_tried(moved)) == (1, 2)


class Chips:
    """Outputs of which some are on, and some cannot be read back."""

    unseen = ("the treads",)

    def __init__(self, on: list[str]) -> None:
        self._on = on

    def outputs_on(self) -> list[str]:
        return self._on

    def make_safe(self) -> list[str]:
        return []


class Watching:
    """A safe-state at its last stage, on a clock that its waits move."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, safe_state: SafeState, on: list[str]
    ) -> None:
        self.now = 0
        self.safe_state = safe_state
        monkeypatch.setattr(module, "monotonic_ns", lambda: self.now)
        monkeypatch.setattr(safe_state, "_outputs", [Chips(on)])

    def result(self, *, signal: bool = False) -> list[str]:
        def wait() -> bool:
            self.now += BETWEEN
            return signal

        return self.safe_state.stays_off(10 * WATCH, wait)


def test_what_cannot_be_read_back_is_off_only_once_its_run_has_acknowledged(
    monkeypatch: pytest.MonkeyPatch, board: Board, path: Path, run: StatisticsFile
) -> None:
    safe_state = SafeState([board], None, path)
    safe_state.take_right()
    at_risk = f"the treads cannot be read back, and process {os.getpid()} may drive it"
    watching = Watching(monkeypatch, safe_state, [])
    assert watching.result() == [at_risk]
    assert watching.now == WATCH
    run.cells[ACKNOWLEDGED] = run.cells[EPOCH]
    assert watching.result() == []
    assert watching.result(signal=True) == ["not checked for 0.5 s"]


def test_a_line_that_is_locked_by_what_cannot_be_seen_is_at_risk(
    monkeypatch: pytest.MonkeyPatch, board: Board, line: Path
) -> None:
    safe_state = SafeState([board], None, None)
    with line.open("rb") as held:
        flock(held, LOCK_EX)  # by this process, which is not looked at
        safe_state.find_runs()
        [at_risk] = Watching(monkeypatch, safe_state, []).result()
    assert at_risk.startswith("a process of another user may drive what is on ")


def test_what_stays_on_is_named_with_the_process_that_drives_it(
    monkeypatch: pytest.MonkeyPatch, board: Board, line: Path
) -> None:
    safe_state = SafeState([board], None, None)
    with opened(line) as process:
        safe_state.find_runs()
        on, by = Watching(monkeypatch, safe_state, ["outputs 0 are on"]).result()
    assert on == "outputs 0 are on"
    assert by.startswith(f"process {process} (cat) has ")


def test_a_run_that_is_found_on_loses_its_right_at_once_though_a_guard_took_it_meanwhile(
    monkeypatch: pytest.MonkeyPatch, board: Board, path: Path, run: StatisticsFile
) -> None:
    """Else it drives on under the guard's epoch, if it was armed again."""
    safe_state = SafeState([board], None, path)
    safe_state.take_right()
    run.cells[EPOCH] = 7
    Watching(monkeypatch, safe_state, ["outputs 0 are on"]).result(signal=True)
    assert run.cells[EPOCH] < 0
