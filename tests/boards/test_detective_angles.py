import pytest
from firmware_boards.detective.angles import are_close, growth, shorter_way_grows
from firmware_boards.detective.messages import Degree, Message
from firmware_boards.detective.sensors import Compass2
from hypothesis import given, settings
from hypothesis import strategies as st

DEGREES = st.decimals(-1000, 1000, places=3).map(float)


@settings(deadline=None)
@given(DEGREES, DEGREES)
def test_growth_leads_from_start_to_end(start: float, end: float) -> None:
    grown = growth(start, end)
    assert 0 <= grown < 360
    assert are_close(start + grown, end, 0)


@settings(deadline=None)
@given(DEGREES, DEGREES)
def test_the_way_taken_is_no_longer_than_half_a_turn(heading: float, target: float) -> None:
    grown = growth(heading, target)
    assert (grown if shorter_way_grows(heading, target) else (360 - grown) % 360) <= 180


@settings(deadline=None)
@given(DEGREES, st.integers(-3, 3))
def test_whole_turns_make_no_difference_to_a_match(angle: float, turns: int) -> None:
    assert are_close(angle, angle + 360 * turns, 0)
    assert not are_close(angle, angle + 360 * turns + 0.001, 0)


def test_kinds_of_message_never_compare_equal() -> None:
    assert Degree(1) == Degree(1.0)
    assert Message(1) == Message(1.0)
    assert Degree(1) != Message(1)


@pytest.mark.parametrize("tolerance", [-1.0, float("nan")])
def test_a_tolerance_that_nothing_could_meet_is_refused(tolerance: float) -> None:
    with pytest.raises(ValueError, match="expected zero or more"):
        Compass2("compass2", tolerance_deg=tolerance)
