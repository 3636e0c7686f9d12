"""The watch for late activations: each is reported once, and none from before it began."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.statistics.late_watch import Late, LateWatch
from firmware_runtime.statistics.statistics import Statistics
from tests.support.written_run import LAYOUT, WrittenRun

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
