"""`bench timing`: what is made of samples; one real run of each contestant, without times."""

import shutil

import pytest

from benchmarks import timing
from benchmarks.timing_contestants import Taken, Task, cyclictest, executive, from_cyclictest
from benchmarks.timing_text import timing_text
from firmware_runtime.cli.main import main

REPORT = {
    "resolution_in_ns": 1,
    "thread": {"0": {"histogram": {"900": 2, "100": 7}, "cycles": 10, "max": 5000}},
}
SETTINGS = {"fifo_priority": {"asked": 80, "granted": False, "reason": "no"}}


def taken(*samples: tuple[int, int]) -> Taken:
    return Taken(samples, samples[-1][0], 0.03, SETTINGS)


def test_what_cyclictest_reports_is_read_with_its_overflows() -> None:
    found = from_cyclictest(REPORT, 0.5)
    assert found.samples == [(100, 7), (900, 2), (5000, 1)]
    assert (found.count, found.largest, found.cpu) == (10, 5000, 0.5)


def test_a_percentile_is_the_sample_of_that_rank() -> None:
    found = taken((10, 500), (20, 490), (30, 9), (99, 1))
    assert [found.percentile(rank) for rank in (500, 990, 999, 1000)] == [10, 20, 30, 99]


def test_ratios_are_ours_by_cyclictest_s_and_the_p99_without_spin_comes_last() -> None:
    report = timing.report_of(
        {
            "cyclictest": [taken((10_000, 100))] * 3,
            "executive": [taken((12_000, 100)), taken((13_000, 100)), taken((90_000, 100))],
            "executive, spinning": [taken((1_000, 100))] * 3,
        },
        rate_hz=1000,
        priority=80,
        spin_us=150,
    )
    assert report["ratios"]["executive"]["p50"] == 1.3
    assert report["ratios"]["executive, spinning"]["p99"] == 0.1
    assert report["ratio"] == 1.3
    text = timing_text(report).splitlines()
    assert text[-1].startswith("ratio 1.30 ")
    assert "not granted: fifo_priority" in text


def test_without_cyclictest_one_sentence_names_the_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(timing, "is_installed", lambda: False)
    assert main(["bench", "timing"]) == 2
    assert "Debian package rt-tests" in capsys.readouterr().err


@pytest.mark.slow
def test_the_executive_runs_every_period() -> None:
    found = executive(Task(1_000_000, 0.2, 0, 0.0))
    assert 0 < found.count <= 200
    assert found.largest >= found.percentile(999) > 0
    assert found.settings["timer_slack_ns"]["asked"] == 1


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("cyclictest") is None, reason="needs the Debian package rt-tests")
def test_cyclictest_runs_every_period() -> None:
    found = cyclictest(Task(1_000_000, 0.2, 0, 0.0))
    assert found.count == 200
