"""Instants of a run as instants of ROS."""

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.ros2.ports_end import CLOCK_SET, Stamps

TO_SYSTEM = 1_700_000_000 * SECOND


def test_an_instant_is_placed_by_what_the_run_said_of_its_time() -> None:
    stamps = Stamps()
    assert not stamps.is_known
    stamps.measure(2 * SECOND, 100 * SECOND, TO_SYSTEM)
    assert stamps.is_known
    assert stamps.of("a", 2 * SECOND) == TO_SYSTEM + 100 * SECOND
    assert stamps.of("a", 3 * SECOND) == TO_SYSTEM + 101 * SECOND


def test_a_small_step_back_of_the_system_clock_does_not_turn_stamps_back() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    first = stamps.of("a", SECOND)
    stamps.measure(SECOND, SECOND, TO_SYSTEM - 5 * MILLISECOND)
    assert stamps.of("a", SECOND + MILLISECOND) == first
    assert stamps.of("b", SECOND) == first - 5 * MILLISECOND
    assert stamps.of("a", SECOND + 6 * MILLISECOND) == first + MILLISECOND


def test_a_clock_that_was_set_is_followed() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    first = stamps.of("a", SECOND)
    stamps.measure(SECOND, SECOND, TO_SYSTEM - 2 * CLOCK_SET)
    assert stamps.of("a", SECOND) == first - 2 * CLOCK_SET


def test_the_pace_of_scaled_time_is_found() -> None:
    stamps = Stamps()
    stamps.measure(0, 0, TO_SYSTEM)
    stamps.measure(10 * SECOND, SECOND, TO_SYSTEM)
    assert stamps.of("a", 20 * SECOND) == TO_SYSTEM + 2 * SECOND


def test_the_next_run_begins_again() -> None:
    stamps = Stamps()
    stamps.measure(50 * SECOND, 60 * SECOND, TO_SYSTEM)
    stamps.forget()
    assert not stamps.is_known
    stamps.measure(SECOND, 100 * SECOND, TO_SYSTEM)
    assert stamps.of("a", 2 * SECOND) == TO_SYSTEM + 101 * SECOND
