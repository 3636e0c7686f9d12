"""What is kept of a run's numbers and states: within a bound, and no peak is lost."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.live.trace import ROOM, STAYS, States, Trace
from firmware_runtime.view.thinning import thinned

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, width=32)


@pytest.mark.slow
@given(st.lists(NUMBERS, max_size=400), st.integers(2, 60))
def test_thinned_points_keep_the_least_and_the_greatest(values: list[float], most: int) -> None:
    times = [float(at) for at in range(len(values))]
    kept_times, kept = thinned(times, values, most)
    assert len(kept) <= max(most, 2) + 2
    assert list(kept_times) == sorted(kept_times)
    if values:
        assert (min(kept), max(kept)) == (min(values), max(values))


def test_a_trace_keeps_its_newest_points_and_every_peak() -> None:
    trace = Trace()
    for at in range(3 * ROOM):
        trace.add(float(at), 1000.0 if at == 7 else float(at % 5))
    newest = trace.since(3 * ROOM - 101.0, 1000)
    assert newest.times == [float(at) for at in range(3 * ROOM - 100, 3 * ROOM)]
    whole = trace.between(0.0, 3.0 * ROOM, 500)
    assert len(whole.times) <= 502
    assert max(each for each in whole.values if each is not None) == 1000.0


def test_what_is_no_finite_number_leaves_a_gap() -> None:
    trace = Trace()
    trace.add(0.0, float("nan"))
    trace.add(1.0, 2.0)
    assert trace.since(-1.0, 10) == ([0.0, 1.0], [None, 2.0])


def test_states_are_entered_once_and_the_newest_are_kept() -> None:
    states = States()
    assert states.enter(0.0, "off")
    assert not states.enter(1.0, "off")
    for at in range(2 * STAYS):
        states.enter(float(at + 2), f"{at}")
    assert len(states.entries) <= STAYS
    assert states.entries[-1] == (2.0 * STAYS + 1, f"{2 * STAYS - 1}")
    assert states.since(2.0 * STAYS) == [states.entries[-1]]


def test_a_stretch_of_states_begins_with_what_it_was_in() -> None:
    states = States()
    for at, name in enumerate(("a", "b", "c")):
        states.enter(float(at), name)
    assert states.between(0.5, 1.5) == [(0.0, "a"), (1.0, "b")]
