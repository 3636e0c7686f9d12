"""Numbers in words, places on scales, and the verdict."""

from itertools import pairwise
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics import number_formats as words
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.view.report.verdict import verdict
from firmware_runtime.view.scales import count_scale, log_scale, share_scale, time_scale
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


@given(st.lists(st.integers(0, 10**13), min_size=1, max_size=20))
def test_a_logarithmic_scale_keeps_order_and_holds_all(values: list[int]) -> None:
    scale = log_scale(values)
    places = [scale.place(value) for value in sorted(values)]
    assert places == sorted(places)
    assert places[0] >= 0
    assert places[-1] <= 1
    assert scale.place(10**20) == 1


@given(st.integers(0, 10**12))
def test_one_is_to_be_seen_on_a_scale_of_counts(most: int) -> None:
    scale = count_scale(most)
    assert 0 < scale.place(1) < scale.place(max(most, 2)) <= 1 + 1e-9
    assert scale.place(0) == 0
    assert scale.ticks[0].text == "1"


@given(st.floats(0, 100))
def test_a_scale_of_shares_begins_at_nothing_and_holds_the_greatest(greatest: float) -> None:
    scale = share_scale(greatest)
    assert scale.ticks[0] == (0, "0 %")
    assert scale.place(greatest) <= 1
    assert len({tick.text for tick in scale.ticks}) == 5


@pytest.mark.slow
@given(st.integers(0, 5 * 86_400 * SECOND), st.integers(MILLISECOND, 5 * 86_400 * SECOND))
def test_the_marks_of_time_are_round_few_and_even(begin: int, span: int) -> None:
    ticks = time_scale(begin, begin + span).ticks
    assert len(ticks) <= 7
    assert len({tick.text for tick in ticks}) == len(ticks)
    gaps = [later.place - earlier.place for earlier, later in pairwise(ticks)]
    assert gaps == pytest.approx([min(gaps, default=0)] * len(gaps))


@pytest.mark.parametrize(
    ("state", "css", "word"),
    [
        (RunState.RUNNING, "doubtful", "Skipped activations"),
        (RunState.ENDED, "doubtful", "Skipped activations"),
        (RunState.FAILED, "bad", "Failed"),
        (RunState.OVERRUN, "bad", "Stopped for lateness"),
    ],
)
def test_the_verdict_has_a_word_and_a_colour(state: RunState, css: str, word: str) -> None:
    judged = verdict(uneven_run(20).statistics(state).figures())
    assert (judged.css, judged.word) == (css, word)


def test_a_run_that_died_is_said_to_have() -> None:
    judged = verdict(uneven_run(20).statistics(alive=False, complete=False).figures())
    assert (judged.css, judged.word) == ("bad", "Died")
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
