"""`stats` in all its forms, on the file of a run that is over."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import ARMED, ELAPSED, MODEL, Layout
from firmware_runtime.statistics.number_formats import milliseconds
from firmware_runtime.statistics.summary import summary
from firmware_runtime.statistics.takeovers import Takeover, note_takeover

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


def printed(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert main(["stats", *map(str, words)]) == 0
    return capsys.readouterr().out


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
    file: StatisticsFile, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    writer = file.header.writer
    note_takeover(path, Takeover(at_ns=1, writer=writer, number=1, why="it hung"))
    assert "guard: it hung" in printed(capsys, "--statistics", path, "--worst", 1)
    text = printed(capsys, "--statistics", path, "--worst", 0)
    assert text.splitlines()[0] == summary(file.statistics().figures())
    assert "worst" not in text
    assert "guard" not in text
    assert "budget" in text


def test_since_shows_what_is_new_and_moves_the_cursor(
    file: StatisticsFile, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--statistics", path, "--since", tmp_path / "cursor", "--json")
    assert json.loads(printed(capsys, *words))["run"] == 359_998
    assert json.loads(printed(capsys, *words))["run"] == 0
    for name in ("scheduled", "run"):
        file.cells[LAYOUT.model(0) + MODEL.index(name)] += 5
    Histogram(file.cells[LAYOUT.lateness(0)]).record(70_000)
    found = json.loads(printed(capsys, *words))
    assert found["run"] == 5
    assert found["lateness_us"]["max"] <= 71.7
    assert json.loads(printed(capsys, *words))["lateness_us"]["max"] is None


def test_a_new_run_is_all_new_to_an_old_cursor(
    file: StatisticsFile, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--statistics", path, "--since", tmp_path / "cursor", "--json")
    printed(capsys, *words)
    again = StatisticsFile(LAYOUT, HEADER, path)
    again.cells[LAYOUT.model(0) + MODEL.index("run")] = 7
    assert file.cells[ELAPSED] > 0
    assert json.loads(printed(capsys, *words))["run"] == 7


def test_a_damaged_cursor_is_refused_in_one_sentence(
    file: StatisticsFile, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "cursor").write_text("not this")
    assert main(["stats", "--statistics", str(path), "--since", str(tmp_path / "cursor")]) == 2
    assert "not a whole statistics file" in capsys.readouterr().err
    assert (tmp_path / "cursor").read_text() == "not this"
    assert file.cells[ELAPSED] > 0


def test_two_runs_are_compared_figure_by_figure(
    file: StatisticsFile, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "kept.stats"
    printed(capsys, "--statistics", path, "--save", kept)
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 6
    found = json.loads(printed(capsys, "--diff", kept, path, "--json"))
    assert found["conditions"] == {}
    assert found["figures"]["overruns"] == {"a": 3, "b": 6, "ratio": 2}
    assert found["figures"]["episodes"]["ratio"] is None
    assert re.search(r"overruns +3 +6 +2\.000", printed(capsys, "--diff", kept, path))


def test_runs_are_merged(
    file: StatisticsFile, path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "kept.stats"
    printed(capsys, "--statistics", path, "--save", kept)
    assert json.loads(printed(capsys, "--merge", kept, path, "--json"))["scheduled"] == 720_000
    assert file.cells[ELAPSED] > 0


@pytest.mark.parametrize(
    "words",
    [["--json", "--histogram"], ["--diff", "a", "b", "--merge", "c"], ["--json", "--prometheus"]],
)
def test_options_that_exclude_each_other_are_refused(words: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["stats", *words])
    assert ended.value.code == 2


def parsed_as_plotting_scripts_do(text: str) -> list[tuple[int, int]]:
    """Lines without `#`: a microsecond, and the first column."""
    rows = [line.split() for line in text.splitlines() if line and not line.startswith("#")]
    return [(int(row[0]), int(row[1])) for row in rows]


def test_the_histogram_counts_every_sample_in_cyclictest_s_layout(
    file: StatisticsFile, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = printed(capsys, "--statistics", path, "--histogram")
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
    file: StatisticsFile, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["cyclictest", "-q", "-h", "5", "-l", "20", "-i", "1000"]
    theirs = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    ours = printed(capsys, "--statistics", path, "--histogram")

    def shape(text: str) -> list[str]:
        marks = [re.sub(r"\d+", "0", line) for line in text.splitlines()]
        return list(dict.fromkeys(mark.split(":")[0] for mark in marks))

    wanted = [line for line in shape(theirs) if "cpu_dma_latency" not in line]
    assert set(wanted) - set(shape(ours)) <= {""}
    assert file.cells[ELAPSED] > 0
