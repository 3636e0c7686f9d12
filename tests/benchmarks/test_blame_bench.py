from pathlib import Path

import pytest
from msgspec import structs

from benchmarks.blame.bench import judged
from benchmarks.blame.causes import INJECTED
from benchmarks.blame.text import report_text
from benchmarks.blame.trial import NOT_LATE, Trial, TrialError, verdicts
from benchmarks.shared.conditions import conditions
from firmware_runtime.statistics.blame import BLAME, CAUSES, BlameRow, Cause
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import HEARTBEAT, Layout
from firmware_runtime.statistics.worst_list import WorstList

LAYOUT = Layout(models=("victim",), timed=("victim",), worst=4, blame=BLAME, causes=CAUSES)
STATED = {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}


def row(cause: Cause, of_ns: int) -> tuple[int, ...]:
    return structs.astuple(BlameRow(cause=1 + CAUSES.index(cause), of_ns=of_ns))


@pytest.fixture
def file() -> StatisticsFile:
    """Two late activations near 100 ms, one at 300 ms; the run began at 1 s of CLOCK_MONOTONIC."""
    file = StatisticsFile(LAYOUT, {"models": {"victim": STATED}, "conditions": {}})
    worst = WorstList(file.cells, LAYOUT)
    for t_ms, cause, late_ms in ((100, Cause.MODEL, 2), (110, Cause.BUS, 9), (300, Cause.DISK, 3)):
        late = late_ms * 1_000_000
        worst.keep([t_ms * 1_000_000, 0, late, 0, late, 0, 0, 0, *row(cause, late)])
    file.open_section()
    file.close_section(500_000_000)
    file.cells[HEARTBEAT] = 1_500_000_000
    return file


def test_an_injection_is_what_the_latest_activation_in_its_window_was_put_down_to(
    file: StatisticsFile,
) -> None:
    windows = [(1_099_000_000, 1_115_000_000), (1_301_000_000, 1_301_500_000)]
    assert verdicts(file.statistics(), windows) == {Cause.BUS: 1, Cause.DISK: 1}


def test_a_window_without_a_late_activation_is_not_late(file: StatisticsFile) -> None:
    assert verdicts(file.statistics(), [(1_200_000_000, 1_210_000_000)]) == {NOT_LATE: 1}


def test_right_unknown_and_wrong_add_up_to_what_was_late() -> None:
    found = judged("stop", {Cause.STOPPED: 47, Cause.UNKNOWN: 2, Cause.MODEL: 1, NOT_LATE: 5})
    assert (found["late"], found["right"], found["unknown"], found["wrong"]) == (50, 47, 2, 1)
    assert found["share"] == 0.94
    assert judged("stop", {NOT_LATE: 5})["share"] is None


def test_the_table_has_a_row_for_each_cause_and_says_what_was_not_run() -> None:
    rows = {
        "stop": judged("stop", {Cause.STOPPED: 50}),
        "quota": {"not_run": "no control groups with the controller cpu are mounted"},
    }
    report = {
        "conditions": conditions(),
        "times": 50,
        "causes": rows,
        "wanted": 0.95,
        "least_share": 1.0,
    }
    text = report_text(report)
    assert "stop      stopped          50   100%" in text
    assert "quota: not run: no control groups" in text
    assert text.endswith("ratio 1.00 (the least)")


def test_every_injection_has_a_name_that_the_statistics_know() -> None:
    assert {each.right for each in INJECTED.values()} <= set(Cause)


def test_a_move_takes_two_processors(tmp_path: Path) -> None:
    with pytest.raises(TrialError, match="one processor"):
        Trial("move", 1, 1, (0,), tmp_path).run()
