"""Causes of lateness, the watch for it, and the link of a run."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import convert, structs
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.links.cut.counts import Carried, Counts
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.statistics.blame import BLAME, CAUSES, BlameRow, Cause, sentence, verdict_of
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.figures import figures_of
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram, bucket_of, upper_edge
from firmware_runtime.statistics.history import WorstList
from firmware_runtime.statistics.late_watch import Late, LateWatch
from firmware_runtime.statistics.layout import LINK, Layout
from firmware_runtime.statistics.metrics import exposition
from firmware_runtime.statistics.rows import REFUSALS
from firmware_runtime.statistics.run_text import statistics_text
from firmware_runtime.statistics.statistics import Statistics
from tests.support.written_run import LAYOUT, WrittenRun

BLAMED = Layout(
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
    file = StatisticsFile(BLAMED, {"models": {"imu": STATED}, "conditions": {}})
    worst = WorstList(file.cells, BLAMED)
    spent = [0] * 17
    file.open_section()
    worst.keep([10, 0, 3_200_000, 90_000, 3_200_000, 0, 0, *spent, *structs.astuple(PREEMPTED)])
    worst.keep([20, 0, 40_000, 90_000, 40_000, 0, 0, *spent, *structs.astuple(BlameRow())])
    file.cells[BLAMED.late_by_cause][PREEMPTED.cause - 1] = 4
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
    description = BLAMED.describe()
    del description["blame"], description["causes"]
    before = convert(description, Layout)
    assert before.place_cells == BLAMED.place_cells - len(BLAME)
    assert before.cells == before.link
    file = StatisticsFile(before, {"models": {"imu": STATED}, "conditions": {}})
    assert file.statistics().figures().late_by_cause is None


def test_a_file_with_other_causes_and_cells_is_read_by_its_own_names() -> None:
    other = structs_of(blame=("cause", "of_ns", "cosmic_rays"), causes=("sun", "moon"))
    row = BlameRow(cause=2)
    assert verdict_of(row, BLAMED) is not None
    file = StatisticsFile(other, {"models": {"imu": STATED}, "conditions": {}})
    WorstList(file.cells, other).keep([10, 0, 5, 5, 5, 0, 0, *[0] * 17, 2, 4000, 7])
    blame = file.statistics().figures().worst[0].blame
    assert blame is not None
    assert (blame.cause, blame.of_us, blame.evidence) == ("moon", 4.0, {"cosmic_rays": 7})


def structs_of(**parts: tuple[str, ...]) -> Layout:
    return convert({**BLAMED.describe(), **parts}, Layout)


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
    blame = verdict_of(row, BLAMED)
    assert blame is not None
    assert sentence(blame) == said


@pytest.mark.parametrize(("cause", "culprit"), [(len(CAUSES) + 1, 0), (-5, 0)])
def test_a_cause_that_the_file_does_not_name_is_none(cause: int, culprit: int) -> None:
    assert verdict_of(BlameRow(cause, culprit), BLAMED) is None


def test_a_culprit_that_the_file_does_not_name_is_none() -> None:
    for cause, culprit in ((Cause.MODEL, 7), (Cause.BUS, 0x168)):
        blame = verdict_of(BlameRow(1 + CAUSES.index(cause), culprit, 1, 1), BLAMED)
        assert blame is not None
        assert blame.culprit is None


LIMIT = 2 * MILLISECOND


def late_run(*lateness: int) -> WrittenRun:
    run = WrittenRun()
    for late in lateness:
        activation(run, late)
    return run


def activation(run: WrittenRun, late: int, *, kept: bool = True) -> int:
    """One activation, kept among the worst or not; returns its deadline."""
    at = run.elapsed + 10 * MILLISECOND
    run.activation(at, late, 0)
    if kept:
        run.keep([0, 0, 0], t_ns=at, lateness_ns=late)
    return at


def test_what_was_late_before_the_watch_is_not_new() -> None:
    run = late_run(5 * MILLISECOND)
    watch = LateWatch(LIMIT, run.statistics())
    assert watch.new_in(run.statistics()) is None


def test_a_late_activation_is_reported_once() -> None:
    run = late_run(5 * MILLISECOND)
    watch = LateWatch(LIMIT, run.statistics())
    at = activation(run, 3 * MILLISECOND)
    assert watch.new_in(run.statistics()) == Late("imu", at, 3 * MILLISECOND)
    assert watch.new_in(run.statistics()) is None


def test_one_within_the_limit_is_not_late() -> None:
    run = late_run()
    watch = LateWatch(LIMIT, run.statistics())
    activation(run, LIMIT)
    assert watch.new_in(run.statistics()) is None
    activation(run, LIMIT + 1)
    assert watch.new_in(run.statistics()) is not None


def test_of_several_the_earliest_is_reported() -> None:
    run = late_run()
    watch = LateWatch(LIMIT, run.statistics())
    first = activation(run, 3 * MILLISECOND)
    activation(run, 9 * MILLISECOND)
    assert watch.new_in(run.statistics()) == Late("imu", first, 3 * MILLISECOND)


def test_one_that_is_not_among_the_worst_is_noticed_by_its_bucket() -> None:
    run = late_run(90 * MILLISECOND)
    watch = LateWatch(LIMIT, run.statistics())
    activation(run, 3 * MILLISECOND, kept=False)
    assert watch.new_in(run.statistics()) == Late("imu", run.elapsed, LIMIT, exact=False)


def test_the_largest_of_all_is_known_even_where_it_is_not_among_the_worst() -> None:
    run = late_run(MILLISECOND)
    watch = LateWatch(LIMIT, run.statistics())
    activation(run, 3 * MILLISECOND, kept=False)
    reported = watch.new_in(run.statistics())
    assert reported == Late("imu", run.elapsed, 3 * MILLISECOND, exact=False)
    assert str(reported) == f"imu before {run.elapsed / 1e9:.3f} s, over 3.00 ms late"


def test_of_a_run_that_took_the_place_of_another_everything_is_new() -> None:
    watch = LateWatch(LIMIT, late_run(5 * MILLISECOND).statistics())
    later = late_run(5 * MILLISECOND).statistics()
    header = structs.replace(later.header, writer=structs.replace(later.header.writer, pid=1))
    assert watch.new_in(replace(later, header=header)) == Late(
        "imu", 10 * MILLISECOND, 5 * MILLISECOND
    )


def test_a_run_without_periodic_models_is_never_late() -> None:
    run = WrittenRun(replace(LAYOUT, models=(), deadlines=()))
    watch = LateWatch(LIMIT, run.statistics())
    assert watch.new_in(run.statistics()) is None


def test_what_falls_into_the_first_bucket_wholly_over_the_limit_is_late() -> None:
    run = late_run(5 * MILLISECOND)
    watch = LateWatch(LIMIT, run.statistics())
    activation(run, upper_edge(bucket_of(LIMIT)) + 1, kept=False)
    assert watch.new_in(run.statistics()) == Late("imu", run.elapsed, LIMIT, exact=False)


@pytest.mark.slow
@given(st.lists(st.integers(0, 4 * LIMIT), max_size=12), st.booleans())
def test_the_watch_fires_only_for_lateness_over_the_limit(late: list[int], kept: bool) -> None:  # noqa: FBT001
    run = late_run(LIMIT // 2)
    watch = LateWatch(LIMIT, run.statistics())
    for each in late:
        activation(run, each, kept=kept)
        reported = watch.new_in(run.statistics()) is not None
        assert reported <= (each > LIMIT)
        assert reported or each <= LIMIT * 33 // 32 + 1


def test_a_poll_reads_the_cells_and_builds_no_document(monkeypatch: pytest.MonkeyPatch) -> None:
    """It happens ten times a second, beside the run."""
    monkeypatch.delattr(Statistics, "figures")
    run = late_run()
    watch = LateWatch(LIMIT, run.statistics())
    at = activation(run, 3 * MILLISECOND)
    assert watch.new_in(run.statistics()) == Late("imu", at, 3 * MILLISECOND)


LINKED = Layout(has_link=True)


def file_of(layout: Layout) -> StatisticsFile:
    return StatisticsFile(layout, {"models": {}, "conditions": {}})


def test_reasons_are_the_fields_of_their_cells() -> None:
    assert tuple(Reason) == REFUSALS


def test_what_was_counted_is_read() -> None:
    file = file_of(LINKED)
    counts = Counts(
        sent=7,
        received=5,
        dropped=1,
        given_up=3,
        unconnected=4,
        carried=Carried({Reason.FORGED: 3}, dropped=1),
    )
    counts.own[Reason.FORGED] += 1
    row = counts.row(is_good=True, silences=2)
    before = file.statistics()
    for index, number in enumerate(row):
        file.cells[LINKED.link + index] = number
    Histogram(file.cells[LINKED.link_age]).record(1_500_000)
    assert len(row) == len(LINK)
    link = file.statistics().figures().link
    assert link is not None
    assert (link.is_good, link.sent, link.received, link.dropped, link.silences) == (
        True,
        7,
        5,
        2,
        2,
    )
    assert (link.given_up, link.unconnected) == (3, 4), "neither is a drop"
    assert link.refused == {**dict.fromkeys(REFUSALS, 0), "forged": 4}
    assert link.age_us.max == 1500
    assert link.round_trip_us.p50 is None
    since = difference(file.statistics(), before).figures().link
    twice = merged([file.statistics(), file.statistics()]).figures().link
    assert since is not None
    assert twice is not None
    assert (since.sent, twice.sent, twice.refused["forged"]) == (7, 14, 8)
    assert any(
        "silences; refused forged 4; dropped 2; given up 3; left while not connected 4" in line
        for line in statistics_text(file.statistics().figures())
    )


def test_prometheus_has_it() -> None:
    file = file_of(LINKED)
    counts = Counts(sent=7)
    counts.own[Reason.STALE] = 2
    for index, number in enumerate(counts.row(is_good=True, silences=0)):
        file.cells[LINKED.link + index] = number
    Histogram(file.cells[LINKED.link_age]).record(1_500_000)
    Histogram(file.cells[LINKED.round_trip]).record(3_000_000)
    text = exposition("rover.controller", file.statistics())
    assert 'firmware_runtime_link_sent_total{board="rover.controller"} 7.0' in text
    assert 'reason="stale"} 2.0' in text
    for name, spent_s in (("link_age", 0.0015), ("link_round_trip", 0.003)):
        assert f'{name}_seconds_sum{{board="rover.controller"}} {spent_s}' in text
    assert "link" not in exposition("rover", file_of(Layout()).statistics())


def test_a_whole_robot_has_no_link() -> None:
    file = file_of(Layout())
    assert file.statistics().figures().link is None
    assert "link" not in file.statistics().as_json()
    assert not any("link:" in line for line in statistics_text(file.statistics().figures()))
