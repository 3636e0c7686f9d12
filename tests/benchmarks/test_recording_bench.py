"""What a recording costs is said with how sure it is, beside what bare runs differ by."""

import json

import pytest

from benchmarks.recording.lateness import compared, text
from benchmarks.recording.runs import AGAIN, BARE, RECORDED
from firmware_runtime.cli.main import main

BARE_US = [40.0 + each for each in range(12)]


def found(factors: list[float]) -> dict[str, object]:
    runs = {BARE: BARE_US, RECORDED: [a * b for a, b in zip(BARE_US, factors, strict=True)]}
    return compared(runs, RECORDED, BARE)


def test_runs_that_are_as_late_are_within_the_goal_and_longer_ones_miss_it() -> None:
    assert found([1.0] * 12) == {"ratio": 1.0, "low": 1.0, "high": 1.0, "verdict": "within it"}
    assert found([1.1] * 12)["verdict"] == "missed"


def test_runs_that_differ_by_more_than_the_goal_from_one_another_tell_nothing() -> None:
    unlike = found([0.5, 2.0, 0.6, 1.7, 0.9, 1.1, 0.7, 1.6, 0.5, 2.1, 1.2, 0.8])
    assert unlike["verdict"] == "cannot tell here"
    assert "with 98 %" in text(unlike, 12)


def test_too_few_pairs_have_no_interval() -> None:
    few = compared({BARE: [40.0] * 3, AGAIN: [50.0] * 3}, AGAIN, BARE)
    assert (few["low"], few["high"], few["verdict"]) == (None, None, "cannot tell here")
    assert "9 pairs or more, not 3" in text(few, 3)


def test_a_run_that_was_never_late_is_no_division_by_zero() -> None:
    assert compared({BARE: [0.0] * 9, AGAIN: [0.0] * 9}, AGAIN, BARE)["ratio"] == 1.0


@pytest.mark.slow
@pytest.mark.real_time
def test_each_pair_has_its_three_runs_of_either_time(capsys: pytest.CaptureFixture[str]) -> None:
    short = ("--virtual", "0.1", "--real", "0.1")
    assert main(["bench", "recording", "--pairs", "1", *short, "--json"]) == 0
    for figures in json.loads(capsys.readouterr().out)["boards"].values():
        assert [len(runs) for runs in figures["step_us"].values()] == [1, 1, 1]
        assert [len(runs) for runs in figures["lateness_us"]["p99"].values()] == [1, 1, 1]
        assert figures["bytes_per_second"] > 0
