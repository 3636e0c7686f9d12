"""The trace for Perfetto: sound whatever a run did, and true to it."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.recording.exports.observed_run import Moment, Ran
from firmware_runtime.recording.exports.perfetto import chrome_trace
from firmware_runtime.statistics.late_watch import Late
from tests.support.trace_rules import assert_sound, counter, slices
from tests.support.written_run import WrittenRun

STATISTICS = WrittenRun().statistics()


def step(at: int, begin: int, end: int, *ran: tuple[str, int, int]) -> Moment:
    """A step at an instant, from and to readings of the clock, with functions of models."""
    return Moment(at, begin, end, [Ran(model, "internal", *span) for model, *span in ran], [])


TWO_STEPS = [
    step(
        10_000_000,
        10_050_000,
        10_300_001,
        ("imu", 10_100_000, 10_250_500),
        ("thrust", 10_250_500, 10_300_000),
    ),
    step(20_000_000, 20_000_000, 20_000_000, ("imu", 20_000_000, 20_000_000)),
]


def test_a_step_holds_the_functions_that_ran_in_it() -> None:
    trace = chrome_trace("robot", TWO_STEPS)
    assert slices(trace, "loop") == [
        (0, "step", 10_050, 10_300.001),
        (1, "imu", 10_100, 10_250.5),
        (1, "thrust", 10_250.5, 10_300),
        (0, "step", 20_000, 20_000),
        (1, "imu", 20_000, 20_000),
    ]
    named = [each["args"] for each in trace["traceEvents"] if each.get("args", {}).get("function")]
    assert named == [{"function": "internal"}] * 3


def test_waking_has_a_track_of_its_own() -> None:
    trace = chrome_trace("robot", TWO_STEPS)
    assert slices(trace, "waking") == [(0, "waking", 10_000, 10_050)]


def test_counters_follow_lateness_and_step_time() -> None:
    trace = chrome_trace("robot", TWO_STEPS)
    assert counter(trace, "lateness (us)") == [(10_050, 50), (20_000, 0)]
    assert counter(trace, "step (us)") == [(10_050, 250.001), (20_000, 0)]


def test_waking_leaves_out_what_the_steps_before_took() -> None:
    late = [
        step(10 * MILLISECOND, 35 * MILLISECOND, 36 * MILLISECOND),
        step(20 * MILLISECOND, 37 * MILLISECOND, 38 * MILLISECOND),
        step(30 * MILLISECOND, 38 * MILLISECOND, 39 * MILLISECOND),
    ]
    trace = chrome_trace("robot", late)
    assert_sound(trace)
    assert slices(trace, "waking") == [(0, "waking", 10_000, 35_000), (0, "waking", 36_000, 37_000)]
    begun = [each for each in trace["traceEvents"] if each["ph"] == "B" and each["tid"] == 2]
    assert begun[1]["args"] == {"late_us": 17_000, "behind_us": 16_000}
    assert [late for _, late in counter(trace, "lateness (us)")] == [25_000, 17_000, 8_000]


def test_the_process_is_the_board_and_the_conditions_come_along_where_they_are_known() -> None:
    trace = chrome_trace("robot", TWO_STEPS, STATISTICS)
    named = [each for each in trace["traceEvents"] if each["name"] == "process_name"]
    assert [each["args"] for each in named] == [{"name": "robot"}]
    assert trace["otherData"]["conditions"] == STATISTICS.as_json()["conditions"]
    assert chrome_trace("robot", TWO_STEPS)["otherData"] == {}


def test_what_the_trace_was_taken_for_is_marked_when_it_began() -> None:
    late = Late("imu", 10 * MILLISECOND, 2_400_000)
    trace = chrome_trace("robot", TWO_STEPS, STATISTICS, late)
    assert_sound(trace)
    marks = [each for each in trace["traceEvents"] if each["ph"] == "i"]
    assert [(each["name"], each["ts"], each["s"]) for each in marks] == [
        ("imu at 0.010 s, 2.40 ms late", 12_400, "g")
    ]


def test_without_a_step_there_are_only_names() -> None:
    trace = chrome_trace("robot", [], STATISTICS)
    assert_sound(trace)
    assert {each["ph"] for each in trace["traceEvents"]} == {"M"}


STEPS = st.tuples(
    st.integers(0, 5 * MILLISECOND),
    st.integers(0, 40 * MILLISECOND),
    st.lists(st.tuples(st.sampled_from(["imu", "thrust"]), st.integers(0, 10**6)), max_size=5),
    st.integers(0, 10**6),
)


@st.composite
def runs(draw: st.DrawFn) -> list[Moment]:
    """Any row of steps, some of them behind."""
    now, steps = 0, []
    for pause, late, functions, tail in draw(st.lists(STEPS, max_size=12)):
        now += pause
        lap = begun = now
        ran = []
        for model, span in functions:
            ran.append((model, lap, lap + span))
            lap += span
        now = lap + tail
        steps.append(step(max(begun - late, 0), begun, now, *ran))
    return steps


@pytest.mark.slow
@given(runs())
def test_whatever_a_run_did_the_trace_keeps_the_rules(steps: list[Moment]) -> None:
    trace = chrome_trace("robot", steps, STATISTICS)
    assert_sound(trace)
    assert len(slices(trace, "loop")) == sum(1 + len(each.ran) for each in steps)


def test_equal_runs_make_equal_bytes() -> None:
    first, second = (json.dumps(chrome_trace("robot", TWO_STEPS, STATISTICS)) for _ in range(2))
    assert first == second


@given(st.integers(0, 10**15))
def test_an_instant_comes_back_to_the_nanosecond(at: int) -> None:
    trace = chrome_trace("robot", [step(at, at, at)])
    _, _, begin, _ = slices(trace, "loop")[0]
    assert round(begin * 1000) == at
