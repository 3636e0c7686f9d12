from pathlib import Path

import pytest
from msgspec import structs

from benchmarks.blame.bench import NOT_LATE, judged
from benchmarks.blame.causes import INJECTED
from benchmarks.blame.text import report_text
from benchmarks.blame.trial import Trial, TrialError, verdicts
from benchmarks.shared.conditions import conditions
from firmware_runtime.statistics.blame import BLAME, CAUSES, Blame, BlameRow, Cause
from firmware_runtime.statistics.figures import Causes, WorstActivation
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import HEARTBEAT, Layout
from firmware_runtime.statistics.worst_list import WorstList

LAYOUT = Layout(models=("victim",), timed=("victim",), worst=4, blame=BLAME, causes=CAUSES)
STATED = {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}


def row(cause: Cause, of_ns: int) -> tuple[int, ...]:
    return structs.astuple(BlameRow(cause=1 + CAUSES.index(cause), of_ns=of_ns))


def late_one(cause: Cause) -> WorstActivation:
    blame = Blame(cause, None, 0.0, 5000.0, {"run_delay_us": 7.0, "stops": None, "cpu_us": 0.0})
    return WorstActivation(
        t_ns=100_000_000,
        model="victim",
        lateness_us=5000.0,
        step_us=0.0,
        causes=Causes(5000.0, 0.0, 0.0, {}, {}),
        blame=blame,
    )


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
    found = verdicts(file.statistics(), windows)
    assert [each.blame.cause for each in found if each and each.blame] == [Cause.BUS, Cause.DISK]


def test_a_window_without_a_late_activation_is_not_late(file: StatisticsFile) -> None:
    assert verdicts(file.statistics(), [(1_200_000_000, 1_210_000_000)]) == [None]


def test_right_unknown_and_wrong_add_up_to_what_was_late() -> None:
    model = late_one(Cause.MODEL)
    found = judged(
        "stop",
        [late_one(Cause.STOPPED)] * 47 + [late_one(Cause.UNKNOWN)] * 2 + [model] + [None] * 5,
    )
    assert (found["late"], found["right"], found["unknown"], found["wrong"]) == (50, 47, 2, 1)
    assert found["share"] == 0.94
    assert found["named"][NOT_LATE] == 5
    named = [Cause.UNKNOWN, Cause.UNKNOWN, Cause.MODEL]
    assert [each["cause"] for each in found["not_right"]] == named
    assert judged("stop", [None] * 5)["share"] is None


def test_the_table_has_a_row_for_each_cause_and_says_what_was_not_run() -> None:
    rows = {
        "stop": judged("stop", [late_one(Cause.STOPPED)] * 49 + [late_one(Cause.MODEL)]),
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
    assert "stop      stopped          49      1    98%       0%     2%" in text
    assert "stop at 0.100 s was named model, 0.00 ms of 5.00 ms: run_delay_us 7" in text
    assert "quota: not run: no control groups" in text
    assert text.endswith("ratio 1.00 (the least)")


def test_every_injection_has_a_name_that_the_statistics_know() -> None:
    assert {each.right for each in INJECTED.values()} <= set(Cause)


def test_a_move_takes_two_processors(tmp_path: Path) -> None:
    with pytest.raises(TrialError, match="one processor"):
        Trial("move", 1, 1, (0,), tmp_path).run()
