"""Limits on one run: what is kept, what is broken, and where it cannot be told."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from firmware_runtime import MILLISECOND, Atomic, run
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.figures import Figures
from firmware_runtime.statistics.file_header import Conditions, Request
from firmware_runtime.statistics.histogram import Distribution
from firmware_runtime.system.conditions import busy
from sim_doubles.testing.limits import Judgement, Limits, judge, reasons_of
from sim_doubles.testing.timing import assert_timing

ROBOTS = {"clock": "MonotonicClock", "scheduler": "SCHED_FIFO", "governor": "performance"}
LATE = Distribution(p50=20.0, p90=40.0, p99=80.0, p999=90.0, max=300.0, mean=25.0)
STEPS = Distribution(p50=50.0, p90=60.0, p99=70.0, p999=90.0, max=95.0, mean=52.0)


class Ticker(Atomic):
    def initialize(self) -> None:
        self.hold_in("ticks", MILLISECOND)

    def internal(self) -> None:
        self.hold_in("ticks", MILLISECOND)


VIRTUAL = run(Ticker("ticker"), for_s=0.5, clock="virtual").statistics


def conditions(**stated: object) -> Conditions:
    settings = {"lock_memory": Request(True, granted=True, reason=None)}
    return replace(VIRTUAL.conditions, stated={**ROBOTS, **stated}, settings=settings)


def ran(**figures: object) -> Figures:
    """Figures of a run of 500 activations in real time, under a robot's conditions."""
    models = {
        path: replace(each, lateness_us=LATE, step_us=STEPS)
        for path, each in VIRTUAL.models.items()
    }
    measured = {"lateness_us": LATE, "step_us": STEPS, "conditions": conditions(), "models": models}
    return replace(VIRTUAL, **{**measured, **figures})


@pytest.mark.parametrize(
    ("limits", "broken"),
    [
        (Limits(p99_us=80.0, max_us=300.0, step_p99_us=70.0, step_max_us=95.0, skips=0), []),
        (Limits(p99_us=79.0), ["lateness p99: 80.0 us, limit 79.0 us"]),
        (Limits(max_us=299.0), ["lateness at most: 300.0 us, limit 299.0 us"]),
        (Limits(step_p99_us=69.0), ["execution time p99: 70.0 us, limit 69.0 us"]),
        (Limits(step_max_us=94.0), ["execution time at most: 95.0 us, limit 94.0 us"]),
        (Limits(p99_us=79.0, model="ticker"), ["ticker: lateness p99: 80.0 us, limit 79.0 us"]),
    ],
)
def test_each_limit_is_at_most(limits: Limits, broken: list[str]) -> None:
    judged = judge(ran(), limits)
    assert judged.broken == broken
    assert judged.judgement is (Judgement.BROKEN if broken else Judgement.KEPT)


def test_what_is_counted_is_limited_too() -> None:
    figures = ran(skipped=1, coalesced=2, overruns=4, deadline_misses={"a -> b": 5})
    judged = judge(figures, Limits(skips=2, overruns=3, misses=4))
    assert judged.broken == [
        "activations skipped or coalesced: 3, limit 2",
        "overruns: 4, limit 3",
        "deadlines missed: 5, limit 4",
    ]
    assert judge(figures, Limits(skips=3, overruns=4, misses=5)).judgement is Judgement.KEPT


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"scheduler": "SCHED_OTHER"}, "no real-time priority: SCHED_OTHER"),
        ({"virtualised": True}, "a virtual machine, which its host may stop at any time"),
        ({"governor": "powersave"}, "the processors' governor is powersave"),
    ],
)
def test_a_broken_limit_cannot_be_told_where_the_machine_may_be_why(
    changed: dict[str, object], reason: str
) -> None:
    figures = ran(conditions=conditions(**changed))
    assert reasons_of(figures) == [reason]
    judged = judge(figures, Limits(p99_us=1.0))
    assert (judged.judgement, judged.reasons) == (Judgement.CANNOT_TELL, [reason])
    assert judge(figures, Limits(p99_us=1.0), strict=True).judgement is Judgement.BROKEN
    assert judge(figures, Limits(p99_us=80.0)).judgement is Judgement.KEPT


def test_a_setting_that_was_refused_is_a_reason_and_a_priority_given_up_is_none() -> None:
    refused = {"fifo_priority": Request(60, granted=False, reason="not permitted")}
    without = replace(conditions(scheduler="SCHED_OTHER"), settings=refused)
    assert reasons_of(ran(conditions=without)) == ["fifo_priority refused: not permitted"]
    overloaded = replace(without, run=replace(without.run, overloaded_s=3.0))
    assert reasons_of(ran(conditions=overloaded)) == []


@pytest.mark.parametrize(
    ("late", "reasons"),
    [
        (None, []),
        ({"model": 3}, []),
        ({"model": 3, "processor taken": 2}, []),
        (
            {"model": 1, "processor taken": 2, "host": 1},
            ["processor taken 2, host 1; of 4"],
        ),
        ({"stopped": 1}, ["stopped 1; of 1"]),
    ],
)
def test_causes_that_are_the_machines_are_reasons_where_they_made_half_of_the_late_steps(
    late: dict[str, int] | None, reasons: list[str]
) -> None:
    expected = [f"late steps by causes of the machine: {each}" for each in reasons]
    assert reasons_of(ran(late_by_cause=late)) == expected


def test_busy_neighbours_and_a_host_that_withholds_are_reasons() -> None:
    assert busy({"processes": 0.1, "host": 0.01}) == []
    assert busy({"processes": 0.6, "host": 0.05}) == [
        "other processes took 60% of the processors",
        "the host withheld 5% of the processors",
    ]
    judged = judge(ran(), Limits(p99_us=1.0), busy({"processes": 0.6, "host": 0.0}))
    assert judged.judgement is Judgement.CANNOT_TELL
    assert "which may be no fault of the run:" in str(judged)


@pytest.mark.parametrize(
    ("figures", "said"),
    [
        (VIRTUAL, "the run was in virtual time, in which nothing is late and nothing takes time"),
        (ran(run=0), "nothing ran"),
        (ran(run=99), "99 activations; a p99 takes 100 or more"),
    ],
)
def test_what_was_not_measured_is_never_kept(figures: Figures, said: str) -> None:
    judged = judge(figures, Limits(p99_us=1e9, skips=0))
    assert (judged.judgement, judged.unmeasured) == (Judgement.CANNOT_TELL, [said])
    assert judge(figures, Limits(p99_us=1e9), strict=True).judgement is Judgement.BROKEN


def test_few_activations_are_enough_for_a_limit_on_each() -> None:
    assert judge(ran(run=99), Limits(max_us=300.0, skips=0)).judgement is Judgement.KEPT


@pytest.mark.parametrize(
    ("limits", "fault"),
    [
        (Limits(), "no limit; expected one of p99_us, max_us"),
        (Limits(p99_us=-1.0), "p99_us: -1.0; expected 0 or more"),
        (Limits(p99_us=float("nan")), "p99_us: nan; expected 0 or more"),
        (Limits(skips=True), "skips: True; expected 0 or more"),
        (Limits(skips=0, model="tickers"), "did you mean ticker"),
        (Limits(misses=0, model="ticker"), "expected no model with it"),
    ],
)
def test_limits_that_are_none_are_refused(limits: Limits, fault: str) -> None:
    with pytest.raises(ConfigError, match=fault):
        judge(ran(), limits)


def test_the_assertion_fails_with_figures_and_conditions_or_skips_with_the_reason() -> None:
    with pytest.raises(pytest.fail.Exception) as failed:
        assert_timing(ran(), p99_us=70.0)
    said = str(failed.value)
    assert said.startswith("timing limits: broken\n  lateness p99: 80.0 us, limit 70.0 us\n")
    assert "500 of 500 activations run" in said
    shares = {"processes": 0.4, "host": 0.0}
    with pytest.raises(pytest.skip.Exception, match=r"cannot tell here: .* took 40%"):
        assert_timing(ran(), p99_us=70.0, neighbours=shares)
    with pytest.raises(pytest.fail.Exception, match="took 40%"):
        assert_timing(ran(), p99_us=70.0, neighbours=shares, strict=True)
    assert_timing(ran(), p99_us=80.0, neighbours=shares)


def test_a_run_and_a_file_of_statistics_are_asserted_on(tmp_path: Path) -> None:
    path = tmp_path / "ticker.stats"
    result = run(Ticker("ticker"), for_s=0.5, clock="virtual", statistics=path)
    for each in (result, result.statistics, path, str(path)):
        with pytest.raises(pytest.skip.Exception, match="virtual time"):
            assert_timing(each, skips=0)


def test_the_fixture_takes_an_open_board(
    board: Callable[..., Any], assert_timing: Callable[..., None]
) -> None:
    robot = board("tachobot")
    with pytest.raises(pytest.fail.Exception, match="in virtual time"):
        assert_timing(robot, skips=0, strict=True)
    with pytest.raises(pytest.skip.Exception, match="in virtual time"):
        assert_timing(robot, skips=0)
