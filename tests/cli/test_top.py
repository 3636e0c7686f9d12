"""`top` in a real terminal: what it shows, and that it leaves the terminal as it was."""

import io
import os
import pty
import signal
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path
from select import select

import pytest
from msgspec.structs import replace
from rich.console import Console

from firmware_runtime.cli.main import main
from firmware_runtime.statistics import fault_table
from firmware_runtime.statistics.comparison import difference
from firmware_runtime.statistics.fault_table import FaultCount
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Distribution, Histogram
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import MODEL, Layout
from firmware_runtime.statistics.number_formats import three_digits
from firmware_runtime.view.live_screen import models_table, screen
from tests.support.waiting import PATIENCE_S
from tests.support.written_run import WrittenRun

LAYOUT = Layout(
    models=("imu",), timed=("imu",), buses=("i2c1",), worst=2, fault_models=("imu", "esc")
)
HEADER = {
    "models": {"imu": {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}},
    "conditions": {"board": "tachobot", "scheduler": "SCHED_FIFO", "scheduler_priority": 60},
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture(autouse=True)
def file(path: Path) -> StatisticsFile:
    file = StatisticsFile(LAYOUT, HEADER, path)
    file.open_section()
    for name, value in (("scheduled", 100), ("run", 98), ("skipped", 2), ("overruns", 3)):
        file.cells[LAYOUT.model(0) + MODEL.index(name)] = value
    for sample in (60_000, 70_000, 2_000_000):
        Histogram(file.cells[LAYOUT.lateness(0)]).record(sample)
    file.close_section(1_000_000_000)
    return file


class Terminal:
    """`top` on a pseudo-terminal of 80 by 24."""

    def __init__(self, path: Path, *words: str) -> None:
        self._ours, theirs = pty.openpty()
        termios.tcsetwinsize(self._ours, (24, 80))
        self.before = termios.tcgetattr(self._ours)
        command = [sys.executable, "-m", "firmware_runtime.cli", "top", "--statistics", str(path)]
        self.process = subprocess.Popen(
            [*command, *words],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env={**os.environ, "TERM": "xterm", "COLUMNS": "80", "LINES": "24"},
        )
        os.close(theirs)
        self.shown = ""

    def wait_for(self, text: str) -> None:
        while text not in self.shown:
            ready, _, _ = select([self._ours], (), (), PATIENCE_S)
            assert ready, f"{text!r} is not in {self.shown!r}"
            self.shown += os.read(self._ours, 65536).decode(errors="replace")

    def press(self, key: str) -> None:
        os.write(self._ours, key.encode())

    def settings(self) -> list[object]:
        return list(termios.tcgetattr(self._ours))

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        os.close(self._ours)


@pytest.fixture
def terminal(path: Path) -> Iterator[Terminal]:
    opened = Terminal(path, "--interval", "0.05")
    yield opened
    opened.close()


@pytest.mark.slow
@pytest.mark.parametrize("key", ["q", "Q"])
def test_it_shows_the_summary_and_quits_on_a_key(terminal: Terminal, key: str) -> None:
    terminal.wait_for("100 Hz 95.00 % on time, late 3 skip 2/100")
    terminal.wait_for("lately")
    terminal.wait_for("q quit")
    terminal.press(key)
    assert terminal.process.wait(timeout=PATIENCE_S) == 0
    assert terminal.settings() == list(terminal.before)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_leaves_the_terminal_as_it_was(terminal: Terminal, number: signal.Signals) -> None:
    terminal.wait_for("q quit")
    terminal.process.send_signal(number)
    assert terminal.process.wait(timeout=PATIENCE_S) == 0
    assert terminal.settings() == list(terminal.before)


@pytest.mark.slow
def test_it_follows_the_run_unless_paused(terminal: Terminal, file: StatisticsFile) -> None:
    terminal.wait_for("late 3")
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 4
    terminal.wait_for("late 4")
    terminal.press(" ")
    terminal.wait_for("paused")
    terminal.press(" ")
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] = 5
    terminal.wait_for("late 5")


@pytest.mark.slow
def test_a_new_run_is_taken_up(terminal: Terminal, path: Path) -> None:
    terminal.wait_for("late 3")
    again = StatisticsFile(LAYOUT, HEADER, path)
    terminal.wait_for("skip 0/0")
    assert again.cells[0] == 0


def test_without_a_terminal_it_is_shown_once(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["top", "--statistics", str(path)]) == 0
    printed = capsys.readouterr()
    assert "100 Hz 95.00 % on time, late 3 skip 2/100" in printed.out
    assert "no terminal here" in printed.err


def drawn(file: StatisticsFile, width: int, height: int) -> list[str]:
    """The lines of the picture in a terminal of that size."""
    now, paper = file.statistics(), io.StringIO()
    console = Console(file=paper, width=width, height=height, highlight=False)
    console.print(screen(now, now, console.size, paused=False))
    return paper.getvalue().splitlines()


@pytest.mark.parametrize("height", [24, 30, 50])
def test_a_long_tail_of_lateness_leaves_room_for_the_rest(
    file: StatisticsFile, height: int
) -> None:
    lateness, worst = Histogram(file.cells[LAYOUT.lateness(0)]), WorstList(file.cells, LAYOUT)
    for power in range(10, 35):
        lateness.record(1 << power)
        worst.keep([power, 0, 1 << power, *[0] * (LAYOUT.place_cells - 3)])
    lines = drawn(file, 80, height)
    bars = [line for line in lines if line.lstrip().startswith("<")]
    assert len(lines) <= height
    assert sum(int(line.split()[-1]) for line in bars) == lateness.samples
    assert sum("late, step" in line for line in lines) == LAYOUT.worst
    assert lines[-1].startswith("q quit")


def test_faults_are_shown_and_leave_room_for_the_rest(file: StatisticsFile) -> None:
    kinds = [FaultCount(f"Kind{number}", 7, 0, 10**9, "moved " * 40) for number in range(6)]
    fault_table.fill(file.cells[LAYOUT.faults], 0, kinds)
    lines = drawn(file, 80, 24)
    assert "faults 42" in lines[0]
    assert sum(line.startswith("fault: imu Kind") for line in lines) == 4
    assert len(lines) <= 24
    assert lines[-1].startswith("q quit")


@pytest.mark.parametrize("width", [60, 80, 120])
def test_no_number_of_the_table_is_cut(file: StatisticsFile, width: int) -> None:
    table = [line for line in drawn(file, width, 24) if line.startswith(("lateness", "imu"))]
    assert [line.split()[0] for line in table] == ["lateness", "imu"]
    assert "\N{HORIZONTAL ELLIPSIS}" not in "".join(table)


@pytest.mark.parametrize("width", [60, 80, 120])
def test_every_column_says_whether_it_is_of_lately_or_of_the_run(
    file: StatisticsFile, width: int
) -> None:
    lines = drawn(file, width, 24)
    below = next(number for number, line in enumerate(lines) if line.startswith("lateness"))
    when, what, row = (lines[number].split() for number in (below - 1, below, below + 1))
    numbers = [name for name in what if name not in {"lateness", "rate"}]
    assert len(when) == len(numbers)
    assert set(when) == {"lately", "run"}
    assert row[0] == "imu"


def test_what_came_lately_and_in_the_whole_run_stand_side_by_side(file: StatisticsFile) -> None:
    before = file.statistics()
    file.open_section()
    Histogram(file.cells[LAYOUT.lateness(0)]).record(500_000)
    file.cells[LAYOUT.model(0) + MODEL.index("overruns")] += 1
    file.close_section(2_000_000_000)
    now = file.statistics()
    run, lately = (each.figures().models for each in (now, difference(now, before)))
    paper = io.StringIO()
    Console(file=paper, width=80).print(models_table(run, lately, 80, rows=5))
    (row,) = (line for line in paper.getvalue().splitlines() if line.startswith("imu"))
    late = [int(word) for word in row.split() if word.isdigit() and int(word) in {1, 4}]
    assert late == [1, 4]
    assert "2 ms" in row
    assert "50" in row


def test_of_many_models_the_latest_are_shown_with_the_end_of_their_names() -> None:
    model = WrittenRun().statistics().figures().models["compass"]
    models = {
        f"model.MovingSystem.part_{number:02}": replace(
            model, overruns=number, lateness_us=Distribution(1.0, 1.0, 1.0, 1.0, float(number))
        )
        for number in range(20)
    }
    paper = io.StringIO()
    Console(file=paper, width=80).print(models_table(models, models, 80, rows=4))
    shown = [line.split()[0] for line in paper.getvalue().splitlines()[2:]]
    ends = [f"\N{HORIZONTAL ELLIPSIS}MovingSystem.part_{number}" for number in (17, 18, 19)]
    assert shown == [*ends, "17"]


@pytest.mark.parametrize(
    ("us", "said"),
    [
        (None, "-"),
        (0.0, "0 us"),
        (12.34, "12.3 us"),
        (999.6, "1 ms"),
        (126_420.0, "126 ms"),
        (4.3e6, "4.3 s"),
    ],
)
def test_a_time_has_three_digits(us: float | None, said: str) -> None:
    assert three_digits(us) == said
