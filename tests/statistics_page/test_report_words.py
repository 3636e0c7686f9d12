"""Numbers in words, and the verdict."""

from typing import Any

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import SECOND
from firmware_runtime.statistics import number_formats as words
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.view.report.verdict import verdict
from tests.support.written_run import WrittenRun, uneven_run


@pytest.mark.parametrize(
    ("ns", "said"),
    [
        (None, "\N{EN DASH}"),
        (0, "0 s"),
        (7, "7 ns"),
        (46_079, "46.1 µs"),
        (2_099_352, "2.10 ms"),
        (12_345_000_000, "12.35 s"),
    ],
)
def test_a_span_is_said_in_the_unit_that_reads_best(ns: int | None, said: str) -> None:
    assert words.duration(ns) == said


@pytest.mark.parametrize(
    ("part", "said"),
    [
        (None, "\N{EN DASH}"),
        (0, "0 %"),
        (1, "100 %"),
        (0.13, "13.0 %"),
        (0.0042, "0.42 %"),
        (0.00000001, "under 0.01 %"),
        (1.7, "170.0 %"),
    ],
)
def test_a_share_that_is_not_nothing_never_reads_as_nothing(part: float | None, said: str) -> None:
    assert words.share(part) == said


@pytest.mark.parametrize(
    ("ns", "said"),
    [(20 * SECOND, "20.00 s"), (150 * SECOND, "2 min"), (259_500 * SECOND, "72 h 5 min")],
)
def test_long_runs_are_shown_in_minutes_and_hours(ns: int, said: str) -> None:
    assert words.passed(ns) == said


def test_a_condition_is_said_plainly() -> None:
    assert words.plain(None) == "not shown"
    assert words.plain([0, 1]) == "0, 1"
    assert words.plain([]) == "none"
    assert words.plain({"numpy": "2.4", "smbus2": None}) == "numpy 2.4, smbus2 not shown"
    assert words.plain(True) == "yes"


@pytest.mark.parametrize(
    ("state", "judgement", "word"),
    [
        (RunState.RUNNING, "doubtful", "Skipped activations"),
        (RunState.ENDED, "doubtful", "Skipped activations"),
        (RunState.FAILED, "bad", "Failed"),
        (RunState.OVERRUN, "bad", "Stopped for lateness"),
    ],
)
def test_the_verdict_has_a_word_and_a_colour(state: RunState, judgement: str, word: str) -> None:
    judged = verdict(uneven_run(20).statistics(state).figures())
    assert (judged.judgement, judged.word) == (judgement, word)


def test_a_run_that_died_is_said_to_have() -> None:
    judged = verdict(uneven_run(20).statistics(alive=False, complete=False).figures())
    assert (judged.judgement, judged.word) == ("bad", "Died")
    assert judged.sentences[:2] == [
        "The process was gone after 19.90 s without having ended the run.",
        "It died while it wrote: the last step's numbers may be there in part.",
    ]


def test_only_all_of_them_are_a_hundred_percent() -> None:
    figures = uneven_run(20).statistics().figures()
    judged = verdict(replace(figures, scheduled=10**6, run=10**6 - 1, overruns=0))
    assert "99.99 % of 1,000,000 activations ran on time" in " ".join(judged.sentences)


def of(**numbers: Any) -> str:  # noqa: ANN401 -- any number of the statistics
    """The verdict's word for a run on time, but for these numbers."""
    run = WrittenRun()
    run.activation(0, 0, 1000)
    return verdict(replace(run.statistics(RunState.ENDED).figures(), **numbers)).word


def test_the_gravest_is_the_verdict() -> None:
    assert of() == "On time"
    assert of(deadline_misses={"a": 1}) == "Missed deadlines"
    assert of(deadline_misses={"a": 1}, overruns=1) == "Late activations"
    assert of(overruns=1, skipped=1) == "Skipped activations"
    assert of(scheduled=0) == "Nothing to be late"
