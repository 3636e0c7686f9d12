"""Encoders against commands: what a wheel turned, and what its motor was told."""

import pytest
from firmware_drivers.wheel_check import WheelCheck

from firmware_runtime import Strike, open_board
from firmware_runtime.devs.time import MILLISECOND, SECOND, seconds
from firmware_runtime.hal.wire_errors import Implausible, Runaway
from firmware_runtime.runs.open_board import OpenBoard

HALF = SECOND // 2
BY_WHEELS = {"turn_check.course_deg": 180.0}
"""Its compass would tell sooner that it leaves its course."""


@pytest.fixture
def wheel() -> WheelCheck:
    """A wheel that makes 1000 counts a second at full speed, and drives at half of it."""
    wheel = WheelCheck("treads", "left", 1000.0, 100 * MILLISECOND)
    wheel.take(0, 0, 0.5)
    wheel.take(230, HALF, 0.5)  # some of it on the ramp
    return wheel


@pytest.mark.parametrize("counts", [250, 200, 180, 400, 1000])
def test_a_load_or_a_loop_that_was_held_up_is_no_fault(wheel: WheelCheck, counts: int) -> None:
    for number in range(1, 5):
        wheel.take(230 + counts * number, HALF, 0.5)


@pytest.mark.parametrize("counts", [0, 100, 165, -250])
def test_too_little_twice_in_a_row_is_a_fault(wheel: WheelCheck, counts: int) -> None:
    wheel.take(230 + counts, HALF, 0.5)
    with pytest.raises(Implausible, match=r"about 250 counts of its encoder in 0\.50 s"):
        wheel.take(230 + 2 * counts, HALF, 0.5)
    wheel.take(10_000, HALF, 0.5)  # begins again


def test_it_agrees_again_once_it_has_turned_as_told(wheel: WheelCheck) -> None:
    wheel.take(230, HALF, 0.5)
    assert wheel.agrees  # one report too little may be of a loop that was held up
    with pytest.raises(Implausible):
        wheel.take(230, HALF, 0.5)
    wheel.take(230, HALF, 0.5)  # begins again
    assert not wheel.agrees
    wheel.take(480, HALF, 0.5)
    assert wheel.agrees


@pytest.mark.parametrize(
    ("speed", "counts", "is_shown"),
    [(0.014, 7, False), (0.016, 8, True), (0.016, 5, False), (0.016, 6, True), (-0.016, -8, True)],
)
def test_it_agrees_again_from_eight_counts_on_of_which_it_has_turned_most(
    wheel: WheelCheck, speed: float, counts: int, *, is_shown: bool
) -> None:
    assert wheel.agrees
    wheel.take(230, HALF, 0.5)
    with pytest.raises(Implausible):
        wheel.take(230, HALF, 0.5)
    wheel.take(230, HALF, speed)  # begins again
    wheel.take(230 + counts, HALF, speed)
    assert wheel.agrees is is_shown


def test_what_it_was_told_to_and_fro_shows_nothing() -> None:
    wheel = WheelCheck("treads", "left", 1000.0, 0)
    assert wheel.agrees
    wheel.agrees = False
    for number in range(24):  # in ten reports 6 counts, of 5 ahead and 3 back
        wheel.take(round(0.6 * number), SECOND // 50, (0.05, -0.03)[number % 2])
    assert not wheel.agrees


def test_few_counts_and_half_of_what_was_told_do_not_show_that_it_turns(wheel: WheelCheck) -> None:
    wheel.take(230, HALF, 0.5)
    with pytest.raises(Implausible):
        wheel.take(230, HALF, 0.5)
    wheel.take(230, HALF, 0.01)  # begins again
    wheel.take(235, HALF, 0.5)  # 5 counts, as told
    assert not wheel.agrees
    wheel.take(235 + 124, HALF, 0.5)  # of 250
    assert not wheel.agrees


def driven_by_wheels(fault: Strike) -> OpenBoard:
    return open_board("detective", doubles=True, clock="virtual", set=BY_WHEELS, faults=[fault])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "at_s", "output"),
    [
        ("dead", 1.0, 0.0),
        ("dead", 7.0, 1.0),  # told to turn the other way meanwhile
        ("weak", 1.0, 1.0),  # half of what it was told while it stops is within the slack
        ("weak", 4.0, 1.0),
    ],
)
def test_a_tread_that_does_not_turn_as_told_for_good_ends_the_mission(
    kind: str, at_s: float, output: float
) -> None:
    for_good = Strike(kind, "treads", at_s=at_s, amount=output)
    with driven_by_wheels(for_good) as robot:
        outcome = robot.run(20.0)
        (reported,) = robot.statistics.faults["treads"].values()
    assert "wheel's turn is " in outcome.reason
    assert reported.count == 5
    assert robot.now < seconds(at_s) + 8 * SECOND


def test_several_times_as_much_is_a_fault_at_once(wheel: WheelCheck) -> None:
    with pytest.raises(Implausible, match="left wheel's turn is 1100"):
        wheel.take(1330, HALF, 0.5)


def test_a_counter_that_begins_again_is_no_fault() -> None:
    wheel = WheelCheck("treads", "left", 1000.0, 0)
    last = 2**31 - 100  # as the chip has it: 32 bits with a sign
    wheel.take(last, 0, 0.5)
    wheel.take(last + 250 - 2**32, HALF, -0.5)
    wheel.take(last, HALF, 0.0)
    with pytest.raises(Implausible, match="left wheel's turn is 500, expected about 0"):
        wheel.take(last + 500 - 2**32, HALF, 0.0)


@pytest.mark.parametrize(
    ("speed", "counts", "said"),
    [
        (0.1, 0, Implausible),
        (-0.1, 0, Implausible),
        (0.1, -2, Runaway),
        (0.1, 9, Runaway),
        (0.0, 1, Runaway),
        (0.0, -1, Runaway),
    ],
)
def test_reports_in_quick_succession_are_judged_together(
    speed: float, counts: int, said: type[Implausible]
) -> None:
    wheel = WheelCheck("treads", "left", 1000.0, 0)
    turn(wheel, range(10), counts, speed)
    with pytest.raises(Implausible) as found:
        turn(wheel, range(10, 21), counts, speed)
    assert found.type is said


def turn(wheel: WheelCheck, reports: range, counts: int, speed: float) -> None:
    for number in reports:
        wheel.take(counts * number, SECOND // 50, speed)


def test_a_wheel_that_turns_to_and_fro_as_told_between_two_judgements_is_no_fault() -> None:
    wheel, count, speed = WheelCheck("treads", "left", 1000.0, 0), 0, 0.0
    for number in range(100):
        count += round(speed * 20)
        speed = (0.5, -0.5, -0.5)[number % 3]
        wheel.take(count, SECOND // 50, speed)


def test_a_new_check_takes_one_report_of_too_little_and_no_turn_unasked() -> None:
    wheel = WheelCheck("treads", "left", 1000.0, 100 * MILLISECOND)
    for count, speed in ((0, 0.5), (0, 0.5), (250, 0.5)):
        wheel.take(count, HALF, speed)
    wheel = WheelCheck("treads", "left", 1000.0, 100 * MILLISECOND)
    wheel.take(0, HALF, 0.0)
    with pytest.raises(Runaway, match="is 20, expected about 0 counts"):
        wheel.take(20, HALF, 0.0)


def test_what_turns_backwards_is_told_so(wheel: WheelCheck) -> None:
    wheel.take(480, HALF, -0.5)
    wheel.take(260, HALF, -0.5)
    wheel.take(10, HALF, -0.5)
    wheel.take(-240, HALF, 0.0)
    wheel.take(-290, HALF, 0.0)  # it ran out
    with pytest.raises(Implausible):
        wheel.take(-340, HALF, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "after_s", "said"),
    [
        ("dead", 1.1, "Implausible"),
        ("weak", 1.1, "Implausible"),
        ("full-on", 0.6, "Runaway"),
        ("freeze", 0.6, "Implausible"),
    ],
)
def test_the_detective_finds_a_motor_that_does_not_do_as_it_is_told(
    kind: str, after_s: float, said: str
) -> None:
    broken = Strike(kind, "treads", at_s=20.0)
    with driven_by_wheels(broken) as robot:
        robot.run(20.0)
        assert "treads" not in robot.statistics.faults
        robot.run(after_s)
        assert list(robot.statistics.faults["treads"]) == [said]
