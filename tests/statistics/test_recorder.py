"""What the recorder leaves of runs: their statistics, pieces of incidents, and no more."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.recording.blackbox.excerpts import Pieces
from firmware_runtime.statistics import file as statistics_file
from firmware_runtime.statistics import reader as statistics_reader
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import STATE
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.recorder import MOST_LATE, QUIET, SAVE_EVERY, Recorder
from firmware_runtime.statistics.takeovers import Takeover, note_takeover
from firmware_runtime.system.this_process import this_process
from tests.support.written_run import WrittenRun

POLL = 100 * MILLISECOND


class Rig:
    """A recorder that is asked to look, and a run that is written by hand."""

    def __init__(
        self,
        folder: Path,
        *,
        runs: int = 50,
        late: int | None = None,
        budget: int = 1 << 30,
        sync: int = 0,
    ) -> None:
        self.kept = folder / "robot.stats"
        self.folder = folder / "kept"
        self.folder.mkdir(exist_ok=True)
        self.reported: list[str] = []
        log = self.reported.append
        pieces = Pieces(self.kept, budget, sync, log)
        self.pieces: list[tuple[str, int]] = []
        """What it asked to be kept of the recording: why, and the how manieth incident."""
        pieces.keep = lambda why, number: self.pieces.append((why, number))  # type: ignore[method-assign]
        self.recorder = Recorder(self.kept, self.folder, runs, late, log, pieces)
        self.now = 0
        self.runs_begun = 0

    def begin(self) -> WrittenRun:
        """A new run of this very process; its header shows which one."""
        self.runs_begun += 1
        self.writer = replace(this_process(), started_ticks=self.runs_begun)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(statistics_file, "this_process", lambda: self.writer)
            run = WrittenRun(path=self.kept, board="robot")
        end_of_section(run)
        return run

    def poll(self, times: int = 1) -> None:
        for _ in range(times):
            self.now += POLL
            self.recorder.poll(self.now)

    @property
    def files(self) -> list[str]:
        return sorted(path.name for path in self.folder.iterdir())


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Rig:
    """All its runs are of this process, which goes on, whatever identity they state."""
    monkeypatch.setattr(statistics_reader, "is_running", lambda _identity: True)
    return Rig(tmp_path)


def end_of_section(run: WrittenRun, state: RunState = RunState.RUNNING) -> None:
    run.file.open_section()
    run.cells[STATE] = state
    run.file.close_section(run.elapsed)


def activations(path: Path) -> int:
    count: int = read_statistics(path).as_json()["run"]
    return count


def test_without_a_run_there_is_nothing(rig: Rig) -> None:
    rig.poll(3)
    assert (rig.files, rig.reported) == ([], [])


@pytest.mark.slow
def test_a_run_is_kept_at_once_each_minute_and_at_its_end(rig: Rig) -> None:
    run = rig.begin()
    kept = rig.folder / "robot-0001.stats"
    rig.poll()
    assert activations(kept) == 0
    run.activation(0, 20_000, 300_000)
    rig.poll()
    assert activations(kept) == 0
    rig.poll(SAVE_EVERY // POLL)
    assert activations(kept) == 1
    run.activation(SECOND, 20_000, 300_000)
    end_of_section(run, RunState.ENDED)
    rig.poll()
    assert activations(kept) == 2
    assert rig.reported[-1] == f"{kept}: the run is over, its statistics are kept"
    reported = len(rig.reported)
    rig.poll(2 * SAVE_EVERY // POLL)
    assert (rig.files, len(rig.reported)) == (["robot-0001.stats"], reported)


def test_what_was_kept_is_not_written_again_at_each_look(rig: Rig) -> None:
    run = rig.begin()
    rig.poll()
    run.activation(0, 20_000, 300_000)
    rig.poll()
    assert activations(rig.folder / "robot-0001.stats") == 0


def test_a_late_activation_is_kept_once_for_a_while(rig: Rig) -> None:
    run = rig.begin()
    rig.poll()
    run.activation(SECOND, 3 * MILLISECOND, 300_000)
    rig.poll()
    assert rig.pieces == []
    rig.poll(5)
    run.activation(2 * SECOND, 4 * MILLISECOND, 300_000)
    rig.poll(10)
    assert (rig.pieces, rig.files) == ([("late", 1)], ["robot-0001.stats"])
    assert rig.reported[-1] == "incident 1: imu before 1.003 s, over 3.00 ms late"


def test_what_is_late_soon_after_an_incident_is_kept_when_the_quiet_time_is_over(rig: Rig) -> None:
    run = rig.begin()
    rig.poll()
    run.activation(SECOND, 3 * MILLISECOND, 300_000)
    rig.poll(10)
    for second, late in ((3, 4), (4, 500), (5, 6)):
        run.activation(second * SECOND, late * MILLISECOND, 300_000)
        rig.poll(10)
    assert rig.pieces == [("late", 1)]
    rig.poll(QUIET // POLL)
    assert rig.pieces == [("late", 1), ("late", 2)]
    assert rig.reported[-1].endswith("500.00 ms late")
    rig.poll(3 * QUIET // POLL)
    assert len(rig.pieces) == 2


@pytest.mark.parametrize("ending", ["over", "replaced", "closed"])
def test_an_incident_that_waits_is_kept_however_the_following_ends(rig: Rig, ending: str) -> None:
    run = rig.begin()
    rig.poll()
    run.activation(SECOND, 3 * MILLISECOND, 300_000)
    rig.poll(10)
    run.activation(3 * SECOND, 4 * MILLISECOND, 300_000)
    rig.poll()
    assert rig.pieces == [("late", 1)]
    if ending == "closed":
        rig.recorder.close(rig.now)
    elif ending == "replaced":
        rig.begin()
        rig.poll()
    else:
        end_of_section(run, RunState.ENDED)
        rig.poll()
    assert rig.pieces == [("late", 1), ("late", 2)]


@pytest.mark.parametrize("state", [RunState.RUNNING, RunState.ENDED])
def test_a_recorder_that_is_stopped_keeps_what_came_since_it_last_looked(
    rig: Rig, state: RunState
) -> None:
    run = rig.begin()
    said: list[str] = []
    pieces = rig.recorder._pieces
    pieces.sync = lambda: said.append("sync")  # type: ignore[method-assign]
    pieces.over = lambda: said.append("over")  # type: ignore[method-assign]
    rig.poll()
    run.activation(SECOND, 20_000, 300_000)
    end_of_section(run, state)
    rig.recorder.close(rig.now)
    assert said == ["sync" if state is RunState.RUNNING else "over"]
    assert activations(rig.folder / "robot-0001.stats") == 1


def test_lateness_below_the_requested_limit_is_no_incident(tmp_path: Path) -> None:
    rig = Rig(tmp_path, late=50 * MILLISECOND)
    run = rig.begin()
    rig.poll()
    run.activation(SECOND, 3 * MILLISECOND, 300_000)
    rig.poll(10)
    assert rig.pieces == []


def test_a_takeover_by_the_guard_is_kept_too(rig: Rig) -> None:
    rig.begin()
    rig.poll()
    note_takeover(rig.kept, Takeover(1, rig.writer, 1, "no finished step for 205 ms", 10**6))
    rig.poll()
    assert rig.pieces == [], "what comes of it is kept too"
    rig.poll(10)
    assert rig.pieces == [("guard", 1)]
    assert rig.reported[-1].endswith("the guard took over")


@pytest.mark.slow
def test_pieces_of_one_run_are_bounded(rig: Rig) -> None:
    run = rig.begin()
    rig.poll()
    for number in range(1, MOST_LATE + 5):
        run.activation(number * SECOND, (number + 2) * MILLISECOND, 300_000)
        rig.poll(QUIET // POLL + 10)
    assert len(rig.pieces) == MOST_LATE
    (said,) = (line for line in rig.reported if "no more late" in line)
    assert said.startswith(f"{rig.folder / 'robot-0001'}: {MOST_LATE} incidents are kept")
    note_takeover(rig.kept, Takeover(1, rig.writer, 1, "no finished step for 205 ms", 10**6))
    rig.poll(10)
    assert rig.pieces[-1] == ("guard", MOST_LATE + 1)


def test_the_next_run_has_the_next_number_and_the_oldest_makes_room(tmp_path: Path) -> None:
    rig = Rig(tmp_path, runs=2)
    for lateness in (3 * MILLISECOND, 0, 0):
        run = rig.begin()
        rig.poll()
        run.activation(SECOND, lateness, 300_000)
        rig.poll(10)
    assert rig.files == ["robot-0002.stats", "robot-0003.stats"]


def test_what_was_last_seen_of_a_run_is_kept_though_the_next_one_has_begun(rig: Rig) -> None:
    run = rig.begin()
    rig.poll()
    run.activation(SECOND, 0, 300_000)
    rig.poll()
    rig.begin()
    rig.poll()
    assert activations(rig.folder / "robot-0001.stats") == 1
    assert rig.files == ["robot-0001.stats", "robot-0002.stats"]


def test_a_recorder_that_is_started_again_goes_on_with_the_run_it_knew(tmp_path: Path) -> None:
    first = Rig(tmp_path)
    run = first.begin()
    first.poll()
    second = Rig(tmp_path)
    run.activation(SECOND, 0, 300_000)
    second.poll()
    assert second.files == ["robot-0001.stats"]
    assert activations(second.folder / "robot-0001.stats") == 1


def test_a_folder_that_goes_away_is_an_error_with_its_name(rig: Rig) -> None:
    rig.begin()
    rig.poll()
    for path in rig.folder.iterdir():
        path.unlink()
    rig.folder.rmdir()
    with pytest.raises(StatisticsFileError, match="kept/robot-0001"):
        rig.poll(SAVE_EVERY // POLL + 1)
