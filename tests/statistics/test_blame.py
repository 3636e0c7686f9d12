"""Verdicts in a statistics file: by name, for readers of every version."""

import json

import pytest
from msgspec import convert, structs

from firmware_runtime.statistics.blame import BLAME, CAUSES, BlameRow, Cause, sentence, verdict_of
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.figures import figures_of
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.layout import Layout
from firmware_runtime.statistics.run_text import statistics_text

LAYOUT = Layout(
    models=("imu",), timed=("imu",), buses=("i2c1",), worst=2, blame=BLAME, causes=CAUSES
)
STATED = {"period_ns": 10_000_000, "tolerance_ns": 1_000_000, "policy": "skip"}
PREEMPTED = BlameRow(
    cause=1 + CAUSES.index(Cause.PREEMPTED),
    explained_ns=3_100_000,
    of_ns=3_200_000,
    run_delay_ns=3_100_000,
    involuntary=2,
)


@pytest.fixture
def written() -> StatisticsFile:
    """One late activation with a verdict, one with nothing to explain."""
    file = StatisticsFile(LAYOUT, {"models": {"imu": STATED}, "conditions": {}})
    worst = WorstList(file.cells, LAYOUT)
    spent = [0] * 17
    file.open_section()
    worst.keep([10, 0, 3_200_000, 90_000, 3_200_000, 0, 0, *spent, *structs.astuple(PREEMPTED)])
    worst.keep([20, 0, 40_000, 90_000, 40_000, 0, 0, *spent, *structs.astuple(BlameRow())])
    file.cells[LAYOUT.late_by_cause][PREEMPTED.cause - 1] = 4
    file.close_section(1_000_000_000)
    return file


def test_the_json_says_how_much_of_how_much_is_explained(written: StatisticsFile) -> None:
    late, on_time = written.statistics().as_json()["worst"]
    evidence = late["blame"].pop("evidence")
    assert late["blame"] == {
        "cause": "processor taken",
        "culprit": None,
        "explained_us": 3100.0,
        "of_us": 3200.0,
    }
    assert evidence["run_delay_us"] == 3100.0
    assert evidence["involuntary"] == 2
    assert evidence["throttled_us"] is None
    assert "blame" not in on_time


def test_how_often_each_cause_did_it_is_counted(written: StatisticsFile) -> None:
    statistics = written.statistics()
    assert statistics.as_json()["late_by_cause"] == {"processor taken": 4}
    assert merged([statistics, statistics]).figures().late_by_cause == {"processor taken": 8}
    assert difference(statistics, statistics).figures().late_by_cause == {}


def test_the_text_has_the_cause_beside_where_the_time_went(written: StatisticsFile) -> None:
    lines = statistics_text(written.statistics().figures())
    assert "  late steps by cause: processor taken 4" in lines
    assert any("; because: processor taken, 3.10 ms of 3.20 ms" in line for line in lines)


def test_figures_with_verdicts_come_back_from_their_json(written: StatisticsFile) -> None:
    statistics = written.statistics()
    assert figures_of(json.dumps(statistics.as_json()), "here") == statistics.figures()


def test_a_file_of_before_has_room_for_none_and_is_read_as_ever() -> None:
    description = LAYOUT.describe()
    del description["blame"], description["causes"]
    before = convert(description, Layout)
    assert before.place_cells == LAYOUT.place_cells - len(BLAME)
    assert before.cells == before.link
    file = StatisticsFile(before, {"models": {"imu": STATED}, "conditions": {}})
    assert file.statistics().figures().late_by_cause is None


def test_a_file_with_other_causes_and_cells_is_read_by_its_own_names() -> None:
    other = structs_of(blame=("cause", "of_ns", "cosmic_rays"), causes=("sun", "moon"))
    row = BlameRow(cause=2)
    assert verdict_of(row, LAYOUT) is not None
    file = StatisticsFile(other, {"models": {"imu": STATED}, "conditions": {}})
    WorstList(file.cells, other).keep([10, 0, 5, 5, 5, 0, 0, *[0] * 17, 2, 4000, 7])
    blame = file.statistics().figures().worst[0].blame
    assert blame is not None
    assert (blame.cause, blame.of_us, blame.evidence) == ("moon", 4.0, {"cosmic_rays": 7})


def structs_of(**parts: tuple[str, ...]) -> Layout:
    return convert({**LAYOUT.describe(), **parts}, Layout)


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (PREEMPTED, "processor taken, 3.10 ms of 3.20 ms"),
        (BlameRow(cause=1, of_ns=2_000_000), "unknown, 2.00 ms"),
        (
            BlameRow(1 + CAUSES.index(Cause.BUS), 0x68, 4_000_000, 5_000_000),
            "bus i2c1 0x68, 4.00 ms of 5.00 ms",
        ),
        (
            BlameRow(1 + CAUSES.index(Cause.MODEL), 0, 4_000_000, 5_000_000),
            "model imu, 4.00 ms of 5.00 ms",
        ),
    ],
)
def test_a_verdict_in_a_few_words(row: BlameRow, said: str) -> None:
    blame = verdict_of(row, LAYOUT)
    assert blame is not None
    assert sentence(blame) == said


@pytest.mark.parametrize(("cause", "culprit"), [(len(CAUSES) + 1, 0), (-5, 0)])
def test_a_cause_that_the_file_does_not_name_is_none(cause: int, culprit: int) -> None:
    assert verdict_of(BlameRow(cause, culprit), LAYOUT) is None


def test_a_culprit_that_the_file_does_not_name_is_none() -> None:
    for cause, culprit in ((Cause.MODEL, 7), (Cause.BUS, 0x168)):
        blame = verdict_of(BlameRow(1 + CAUSES.index(cause), culprit, 1, 1), LAYOUT)
        assert blame is not None
        assert blame.culprit is None
