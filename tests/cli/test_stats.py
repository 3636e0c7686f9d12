"""`stats` in all its forms, and `report`, on the file of a run that is over."""

import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from time import monotonic_ns

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.locations import recording_of_virtual_run
from firmware_runtime.statistics.file import StatisticsFile, save
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import ARMED, ELAPSED, MODEL, STATE, Layout
from firmware_runtime.statistics.number_formats import local, milliseconds
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.statistics.summary import summary
from firmware_runtime.statistics.takeovers import Takeover, note_takeover
from tests.support.command import Command
from tests.support.written_run import WrittenRun, uneven_run

LAYOUT = Layout(models=("imu",), timed=("imu",), buses=("i2c",), worst=2)
HEADER = {
    "models": {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}},
    "conditions": {
        "board": "tachobot",
        "scheduler": "SCHED_FIFO",
        "scheduler_priority": 60,
        "governor": "performance",
    },
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture
def file(path: Path) -> StatisticsFile:
    """An hour at 100 Hz: three activations late, two skipped."""
    file = StatisticsFile(LAYOUT, HEADER, path)
    file.open_section()
    first = LAYOUT.model(0)
    for name, value in (("scheduled", 360_000), ("run", 359_998), ("skipped", 2), ("overruns", 3)):
        file.cells[first + MODEL.index(name)] = value
    lateness = Histogram(file.cells[LAYOUT.lateness(0)])
    for _ in range(1000):
        lateness.record(180_000)
    lateness.record(2_400_000)
    file.cells[LAYOUT.bus(0) + 4] = 396_000_000_000
    file.cells[ARMED] = 1
    file.close_section(3_600_000_000_000)
    return file


def test_the_one_line_summary_has_this_form(file: StatisticsFile) -> None:
    assert summary(file.statistics().figures()) == (
        "100 Hz 99.99 % on time, late 3 skip 2/360000 p99 0.18 ms max 2.4 ms i2c 11 % FIFO60 "
        "governor=performance armed"
    )


def test_a_share_is_a_hundred_only_if_all_were_on_time(file: StatisticsFile) -> None:
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 1
    assert "99.99 %" in summary(file.statistics().figures())


@pytest.mark.parametrize(
    ("us", "text"),
    [(None, "-"), (0, "0 ms"), (180, "0.18 ms"), (2400, "2.4 ms"), (603_180, "603 ms")],
)
def test_times_have_two_digits(us: float | None, text: str) -> None:
    assert milliseconds(us) == text


def test_a_run_without_periodic_models_has_events_instead() -> None:
    file = StatisticsFile(Layout(), {"models": {}, "conditions": {"scheduler": "SCHED_OTHER"}})
    line = summary(file.statistics().figures())
    assert (
        line == "0 events - % on time, late 0 skip 0/0 p99 - max - OTHER governor=unknown disarmed"
    )


def test_the_text_begins_with_the_summary_and_shows_as_many_worst_as_asked(
    file: StatisticsFile, path: Path, command: Command
) -> None:
    writer = file.header.writer
    note_takeover(path, Takeover(at_ns=1, writer=writer, number=1, why="it hung"))
    assert "guard: it hung" in command.said("stats", "--statistics", path, "--worst", 1)
    text = command.said("stats", "--statistics", path, "--worst", 0)
    assert text.splitlines()[0] == summary(file.statistics().figures())
    assert "worst" not in text
    assert "guard" not in text
    assert "budget" in text


def test_since_shows_what_is_new_and_moves_the_cursor(
    file: StatisticsFile, path: Path, tmp_path: Path, command: Command
) -> None:
    words = ("--statistics", path, "--since", tmp_path / "cursor", "--json")
    assert json.loads(command.said("stats", *words))["run"] == 359_998
    assert json.loads(command.said("stats", *words))["run"] == 0
    for name in ("scheduled", "run"):
        file.cells[LAYOUT.model(0) + MODEL.index(name)] += 5
    Histogram(file.cells[LAYOUT.lateness(0)]).record(70_000)
    found = json.loads(command.said("stats", *words))
    assert found["run"] == 5
    assert found["lateness_us"]["max"] <= 71.7
    assert json.loads(command.said("stats", *words))["lateness_us"]["max"] is None


def test_a_new_run_is_all_new_to_an_old_cursor(
    file: StatisticsFile, path: Path, tmp_path: Path, command: Command
) -> None:
    words = ("--statistics", path, "--since", tmp_path / "cursor", "--json")
    command.said("stats", *words)
    again = StatisticsFile(LAYOUT, HEADER, path)
    again.cells[LAYOUT.model(0) + MODEL.index("run")] = 7
    assert file.cells[ELAPSED] > 0
    assert json.loads(command.said("stats", *words))["run"] == 7


def test_a_damaged_cursor_is_refused_in_one_sentence(
    file: StatisticsFile, path: Path, tmp_path: Path, command: Command
) -> None:
    (tmp_path / "cursor").write_text("not this")
    assert "not a whole statistics file" in command.refused(
        "stats", "--statistics", path, "--since", tmp_path / "cursor"
    )
    assert (tmp_path / "cursor").read_text() == "not this"
    assert file.cells[ELAPSED] > 0


def test_two_runs_are_compared_figure_by_figure(
    file: StatisticsFile, path: Path, tmp_path: Path, command: Command
) -> None:
    kept = tmp_path / "kept.stats"
    command.said("stats", "--statistics", path, "--save", kept)
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 6
    found = command.document("stats", "--diff", kept, path)
    assert found["conditions"] == {}
    assert found["figures"]["overruns"] == {"a": 3, "b": 6, "ratio": 2}
    assert found["figures"]["episodes"]["ratio"] is None
    assert re.search(r"overruns +3 +6 +2\.000", command.said("stats", "--diff", kept, path))


def test_runs_are_merged(
    file: StatisticsFile, path: Path, tmp_path: Path, command: Command
) -> None:
    kept = tmp_path / "kept.stats"
    command.said("stats", "--statistics", path, "--save", kept)
    assert command.document("stats", "--merge", kept, path)["scheduled"] == 720_000
    assert file.cells[ELAPSED] > 0


def parsed_as_plotting_scripts_do(text: str) -> list[tuple[int, int]]:
    """Lines without `#`: a microsecond, and the first column."""
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    return [(int(row[0]), int(row[1])) for row in rows]


def test_the_histogram_counts_every_sample_in_cyclictest_s_layout(
    file: StatisticsFile, path: Path, command: Command
) -> None:
    text = command.said("stats", "--statistics", path, "--histogram")
    rows = parsed_as_plotting_scripts_do(text)
    assert [us for us, _ in rows] == list(range(len(rows)))
    assert sum(count for _, count in rows) == 1001
    assert next(us for us, count in rows if count > 0) in range(175, 181)
    assert "# Total: 000001001" in text
    assert "# Max Latencies: 02400" in text
    assert file.cells[ELAPSED] > 0


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cyclictest") is None, reason="needs the Debian package rt-tests")
def test_the_layout_is_that_of_cyclictest(
    file: StatisticsFile, path: Path, command: Command
) -> None:
    asked = ["cyclictest", "-q", "-h", "5", "-l", "20", "-i", "1000"]
    theirs = subprocess.run(asked, check=True, capture_output=True, text=True).stdout
    ours = command.said("stats", "--statistics", path, "--histogram")

    def shape(text: str) -> list[str]:
        marks = [re.sub(r"\d+", "0", line) for line in text.splitlines()]
        return list(dict.fromkeys(mark.split(":")[0] for mark in marks))

    wanted = [line for line in shape(theirs) if "cpu_dma_latency" not in line]
    assert set(wanted) - set(shape(ours)) <= {""}
    assert file.cells[ELAPSED] > 0


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
    assert "<title>robot: timing report</title>" in output.read_text()


def test_the_page_has_the_line_that_stats_begins_with(
    command: Command, kept: Path, tmp_path: Path
) -> None:
    output = tmp_path / "report.html"
    headline = command("stats", "--statistics", kept).out.splitlines()[0]
    command("report", kept, "-o", output)
    assert f'"text":"{headline}"' in output.read_text()


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
    assert '"400 of 408"' in output.read_text()


def test_what_cannot_be_read_or_written_is_said_in_a_sentence(
    command: Command, kept: Path, tmp_path: Path
) -> None:
    output = tmp_path / "report.html"
    assert "no statistics of nosuch" in command.refused("report", "nosuch", "-o", output)
    assert "report.html: No such file or directory" in command.refused(
        "report", kept, "-o", tmp_path / "absent" / "report.html"
    )
    os.truncate(kept, 100)
    assert "not a whole statistics file" in command.refused("report", kept, "-o", output)
    assert not output.exists()
