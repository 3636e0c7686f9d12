"""The trace for Perfetto: sound whatever was recorded, and true to it."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.statistics.late_watch import Late
from firmware_runtime.statistics.perfetto import chrome_trace, the_last
from firmware_runtime.statistics.spans import Recorded
from tests.support.trace_rules import assert_sound, counter, slices
from tests.support.written_run import WrittenRun

STATISTICS = WrittenRun().statistics()
TWO_STEPS = [
    Recorded("garbage", 9_000_000, 9_500_000),
    Recorded("imu", 10_100_000, 10_250_500),
    Recorded("thrust", 10_250_500, 10_300_000),
    Recorded("waking", 10_000_000, 10_050_000),
    Recorded("step", 10_050_000, 10_300_001),
    Recorded("imu", 20_000_000, 20_000_000),
    Recorded("step", 20_000_000, 20_000_000),
]


def test_a_step_holds_the_functions_that_ran_in_it() -> None:
    trace = chrome_trace(TWO_STEPS, STATISTICS)
    assert slices(trace, "loop") == [
        (0, "step", 10_050, 10_300.001),
        (1, "imu", 10_100, 10_250.5),
        (1, "thrust", 10_250.5, 10_300),
        (0, "step", 20_000, 20_000),
        (1, "imu", 20_000, 20_000),
    ]


def test_waking_and_garbage_have_tracks_of_their_own() -> None:
    trace = chrome_trace(TWO_STEPS, STATISTICS)
    assert slices(trace, "waking") == [(0, "waking", 10_000, 10_050)]
    assert slices(trace, "garbage") == [(0, "garbage", 9_000, 9_500)]


def test_counters_follow_lateness_and_step_time() -> None:
    trace = chrome_trace(TWO_STEPS, STATISTICS)
    assert counter(trace, "lateness (us)") == [(10_050, 50), (20_000, 0)]
    assert counter(trace, "step (us)") == [(10_050, 250.001), (20_000, 0)]


def test_waking_leaves_out_what_the_steps_before_took() -> None:
    recorded = [
        Recorded("waking", 10 * MILLISECOND, 35 * MILLISECOND),
        Recorded("step", 35 * MILLISECOND, 36 * MILLISECOND),
        Recorded("waking", 20 * MILLISECOND, 37 * MILLISECOND),
        Recorded("step", 37 * MILLISECOND, 38 * MILLISECOND),
        Recorded("waking", 30 * MILLISECOND, 38 * MILLISECOND),
        Recorded("step", 38 * MILLISECOND, 39 * MILLISECOND),
    ]
    trace = chrome_trace(recorded, STATISTICS)
    assert_sound(trace)
    assert slices(trace, "waking") == [(0, "waking", 10_000, 35_000), (0, "waking", 36_000, 37_000)]
    begun = [each for each in trace["traceEvents"] if each["ph"] == "B" and each["tid"] == 2]
    assert begun[1]["args"] == {"late_us": 17_000, "behind_us": 16_000}
    assert [late for _, late in counter(trace, "lateness (us)")] == [25_000, 17_000, 8_000]


def test_functions_of_the_step_under_way_stand_without_it() -> None:
    trace = chrome_trace([*TWO_STEPS, Recorded("imu", 30_000_000, 30_400_000)], STATISTICS)
    assert_sound(trace)
    assert slices(trace, "loop")[-1] == (0, "imu", 30_000, 30_400)


def test_the_process_is_the_board_and_the_conditions_come_along() -> None:
    trace = chrome_trace(TWO_STEPS, STATISTICS)
    named = [each for each in trace["traceEvents"] if each["name"] == "process_name"]
    assert [each["args"] for each in named] == [{"name": "robot"}]
    assert trace["otherData"]["conditions"] == STATISTICS.as_json()["conditions"]


def test_what_the_trace_was_taken_for_is_marked_when_it_began() -> None:
    late = Late("imu", 10 * MILLISECOND, 2_400_000)
    trace = chrome_trace(TWO_STEPS, STATISTICS, late)
    assert_sound(trace)
    marks = [each for each in trace["traceEvents"] if each["ph"] == "i"]
    assert [(each["name"], each["ts"], each["s"]) for each in marks] == [
        ("imu at 0.010 s, 2.40 ms late", 12_400, "g")
    ]


def test_only_the_last_part_is_taken_on_request() -> None:
    recorded = [Recorded("step", at * SECOND, at * SECOND + 5) for at in range(10)]
    assert the_last(recorded, 2 * SECOND) == recorded[7:]
    assert the_last(recorded, 100 * SECOND) == recorded
    assert the_last([], SECOND) == []


def test_without_a_record_there_are_only_names() -> None:
    trace = chrome_trace([], STATISTICS)
    assert_sound(trace)
    assert {each["ph"] for each in trace["traceEvents"]} == {"M"}


STEPS = st.tuples(
    st.integers(0, 5 * MILLISECOND),
    st.integers(0, 40 * MILLISECOND),
    st.lists(st.tuples(st.sampled_from(["imu", "thrust"]), st.integers(0, 10**6)), max_size=5),
    st.integers(0, 10**6),
)


@st.composite
def records(draw: st.DrawFn) -> list[Recorded]:
    """What a recorder writes of any row of steps, some of them behind, cut anywhere."""
    now, written = 0, []
    for pause, late, functions, tail in draw(st.lists(STEPS, max_size=12)):
        now += pause
        lap = begun = now
        for model, span in functions:
            written.append(Recorded(model, lap, lap + span))
            lap += span
        if late > 0:
            written.append(Recorded("waking", max(begun - late, 0), begun))
        now = lap + tail
        written.append(Recorded("step", begun, now))
        if draw(st.booleans()):
            written.append(Recorded("garbage", now, now + pause))
            now += pause
    return written[draw(st.integers(0, len(written))) :]


@pytest.mark.slow
@given(records())
def test_whatever_was_recorded_the_trace_keeps_the_rules(recorded: list[Recorded]) -> None:
    trace = chrome_trace(recorded, STATISTICS)
    assert_sound(trace)
    kept = [each for each in recorded if each.track not in {"waking", "garbage"}]
    assert len(slices(trace, "loop")) == len(kept)


def test_equal_records_make_equal_bytes() -> None:
    first, second = (json.dumps(chrome_trace(TWO_STEPS, STATISTICS)) for _ in range(2))
    assert first == second


@given(st.integers(0, 10**15))
def test_an_instant_comes_back_to_the_nanosecond(at: int) -> None:
    trace = chrome_trace([Recorded("step", at, at)], STATISTICS)
    _, _, begin, _ = slices(trace, "loop")[0]
    assert round(begin * 1000) == at
