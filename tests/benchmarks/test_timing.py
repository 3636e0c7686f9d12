"""`bench timing`: what is made of samples; one real run of each contestant, without times."""

import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.timing import bench as timing
from benchmarks.timing.contestants import (
    Lateness,
    Taken,
    Task,
    cyclictest,
    executive,
    from_cyclictest,
)
from benchmarks.timing.report import PLAIN, SPINNING, summary
from benchmarks.timing.text import timing_lines
from firmware_runtime.cli.main import main
from firmware_runtime.system.conditions import Neighbours

REPORT = {
    "resolution_in_ns": 1,
    "thread": {"0": {"histogram": {"900": 2, "100": 7}, "cycles": 10, "max": 5000}},
}
SETTINGS = {"fifo_priority": {"asked": 80, "granted": False, "reason": "no"}}
AT_1_KHZ = Task(1_000_000, 0.2, priority=80)
NO_PEER = pytest.mark.skipif(
    shutil.which("cyclictest") is None, reason="needs cyclictest, of the Debian package rt-tests"
)


def taken(*samples: tuple[int, int]) -> Taken:
    lateness = Lateness(samples, samples[-1][0])
    return Taken(lateness, 0.03, settings=SETTINGS)


def a_round(cyclictest: int, plain: int, spinning: int) -> dict[str, Taken]:
    return {
        "cyclictest": taken((cyclictest, 100)),
        PLAIN: taken((plain, 100)),
        SPINNING: taken((spinning, 100)),
    }


ROUNDS = [
    a_round(10_000, 12_000, 1_000),
    a_round(20_000, 26_000, 2_000),
    a_round(10_000, 90_000, 900),
]


@pytest.mark.parametrize(("in_ns", "unit"), [(1, 1), (0, 1000)])
def test_what_cyclictest_reports_is_read_with_its_overflows(in_ns: int, unit: int) -> None:
    found = from_cyclictest({**REPORT, "resolution_in_ns": in_ns}, 0.5)
    assert found.lateness.samples == [(100 * unit, 7), (900 * unit, 2), (5000 * unit, 1)]
    assert (found.lateness.count, found.lateness.largest, found.cpu) == (10, 5000 * unit, 0.5)


def test_a_percentile_is_the_sample_of_that_rank_and_none_is_over_the_largest() -> None:
    found = taken((10, 500), (20, 490), (30, 9), (99, 1)).lateness
    assert [found.percentile(rank) for rank in (500, 990, 999, 1000)] == [10, 20, 30, 99]
    assert Lateness([(103, 10)], 101).percentile(990) == 101


def test_a_ratio_is_taken_within_a_round_and_the_median_over_rounds_is_kept() -> None:
    found = summary(ROUNDS, AT_1_KHZ, "cyclictest")
    assert found["ratios"][PLAIN] == {"p50": 1.3, "p99": 1.3, "p999": 1.3}
    assert found["ratios"][SPINNING]["p99"] == 0.1
    assert found["ratio"] == 1.3


def test_without_a_peer_the_plain_executive_is_what_others_are_compared_with() -> None:
    alone = [{name: each[name] for name in (PLAIN, SPINNING)} for each in ROUNDS]
    found = summary(alone, AT_1_KHZ, PLAIN)
    assert found["ratios"].keys() == {SPINNING}
    assert found["ratio"] == found["ratios"][SPINNING]["p99"] == pytest.approx(1 / 13)
    assert found["goals"] == {}


@pytest.mark.parametrize(
    "task",
    [
        replace(AT_1_KHZ, period_ns=10_000_000),
        replace(AT_1_KHZ, priority=0),
        replace(AT_1_KHZ, keep_awake=False),
    ],
)
def test_goals_are_for_what_they_were_set_for(task: Task) -> None:
    assert summary(ROUNDS, AT_1_KHZ, "cyclictest")["goals"] != {}
    assert summary(ROUNDS, task, "cyclictest")["goals"] == {}


def test_when_output_functions_began_is_kept_apart_from_lateness() -> None:
    plain = replace(taken((1000, 10)), output=Lateness([(3000, 10)], 2900))
    found = summary([{PLAIN: plain, SPINNING: taken((1, 1))}], AT_1_KHZ, PLAIN)["contestants"]
    assert found[PLAIN]["p50"] == 1000
    assert found[PLAIN]["output"] == {"p50": 2900, "p99": 2900, "p999": 2900, "max": 2900}
    assert found[SPINNING]["output"] is None


def test_every_sample_is_in_one_row_of_the_histogram() -> None:
    samples = [(0, 1), (999, 2), (1000, 4), (1499, 8), (123_456_789_012, 16)]
    found = summary([{PLAIN: taken(*samples), SPINNING: taken(*samples)}], AT_1_KHZ, PLAIN)
    rows = found["contestants"][PLAIN]["histogram"]
    assert rows == {"1000": 3, "1500": 12, str(7_000_000_000): 16}


def test_the_text_has_refusals_neighbours_intervals_and_goals_and_the_ratio_last() -> None:
    section = summary(ROUNDS, AT_1_KHZ, "cyclictest")
    others = {"processes": 0.25, "host": 0.0}
    report = {"rate_hz": 1000, "fifo_priority": 80, "spin_us": 150.0, "ratio": section["ratio"]}
    lines = list(timing_lines({**report, "cpus": {"awake": {**section, "others": others}}}))
    assert (
        "not granted: fifo_priority; meanwhile other processes took 25.0% of the processors, "
        "the host 0.0%"
    ) in lines
    rows = [line.split() for line in lines if line.startswith("<")]
    assert [row[1:3] for row in rows] == [
        [edge, "us"] for edge in ("1", "1.5", "3", "15", "30", "100")
    ]
    assert rows[3][3:] == ["200", "█" * 13, "100", "█" * 13]
    assert [line for line in lines if line.startswith("goal")] == [
        "goal of executive: p50 1.30, at most 1.3: met; p99 1.30, at most 1.5: met",
        "goal of executive, spinning: p50 0.10, at most 1: met; p99 0.10, at most 1: met",
    ]
    assert lines[-1] == "ratio 1.30 (awake: p99 of executive by cyclictest)"


def test_who_else_was_busy_is_what_is_left_of_all_ticks() -> None:
    lines = iter(["cpu  100 0 50 800 10 0 0 5 0 0", "cpu  150 0 70 905 15 0 0 25 7 0"])
    own = iter([30.0, 70.0])
    found = Neighbours(lambda: next(lines), lambda: next(own)).shares()
    assert found == {"processes": 30 / 200, "host": 20 / 200}


def test_without_cyclictest_one_sentence_names_the_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(timing, "cyclictest_is_installed", lambda: False)
    assert main(["bench", "timing"]) == 2
    error = capsys.readouterr().err
    assert "Debian package rt-tests" in error
    assert error.count("\n") == 1


def test_where_processors_cannot_be_kept_awake_only_the_rest_is_measured(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(timing, "CPU_DMA_LATENCY", tmp_path / "absent")
    assert timing._states("both") == ["asleep"]
    assert "may not be written" in capsys.readouterr().err


def test_a_priority_is_asked_for_elsewhere_and_one_that_is_refused_leaves_all_the_usual_class(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = os.sched_getscheduler(0)
    timing._may_have_fifo(80)
    assert os.sched_getscheduler(0) == before

    def refuse(*_arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert not timing._may_have_fifo(80)


@pytest.mark.slow
@pytest.mark.parametrize("spin_us", [0.0, 50.0])
def test_the_executive_runs_or_skips_every_period(spin_us: float) -> None:
    found = executive(Task(1_000_000, 0.2, spin_us=spin_us, keep_awake=False))
    assert found.skipped is not None
    assert found.output is not None
    assert found.lateness.count + found.skipped == 200
    assert found.output.count == found.lateness.count
    assert found.output.largest >= found.lateness.largest > 0
    assert found.settings["timer_slack_ns"]["asked"] == 1
    assert found.settings["spin_us"]["asked"] == spin_us


@pytest.mark.slow
@NO_PEER
def test_cyclictest_runs_every_period() -> None:
    found = cyclictest(Task(1_000_000, 0.2))
    assert found.lateness.count == 200


@pytest.mark.slow
@NO_PEER
def test_a_cyclictest_that_fails_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.timing.contestants.LONGEST_NS", -1)
    with pytest.raises(OSError, match="cyclictest ended with"):
        cyclictest(Task(1_000_000, 0.2))


@pytest.mark.slow
def test_the_bench_keeps_what_it_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--against", "nothing", "--cpus", "asleep", "--seconds", "0.2"]
    options += ["--repetitions", "2", "--json", "--save", str(tmp_path)]
    assert main(["bench", "timing", *options]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "timing-1000.json").read_text()) == printed
    for each in printed["cpus"]["asleep"]["contestants"].values():
        assert each["samples"] + each["skipped"] == 400
