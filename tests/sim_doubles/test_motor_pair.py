"""Ramps and their exact turn, against a sum over every stretch and by hand; clock, warnings."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_doubles.chips.motor_pair import MotorPair, Ramp
from sim_doubles.chips.protocol_warnings import ProtocolWarnings
from sim_doubles.clock import ManualClock

NEVER = (1 << 63) - 1


def test_a_ramp_steps_after_each_period_and_is_integrated_step_by_step() -> None:
    ramp = Ramp(since=100, start=2, target=9, step=3, first_at=110, period=20)
    speeds = [ramp.speed(at) for at in (100, 109, 110, 129, 130, 149, 150, 1000)]
    assert speeds == [2, 2, 5, 5, 8, 8, 9, 9]
    assert [ramp.next_step_at(at) for at in (100, 110, 149, 150)] == [110, 130, 150, NEVER]
    ramp = Ramp(since=0, start=4, target=-3, step=5, first_at=10, period=10, turned_before=7)
    turned = [ramp.turned(at) for at in (0, 10, 15, 20, 30)]
    assert turned == [7, 47, 42, 37, 7]  # 4 x 10, then -1 x 10, then -3 x 10


def test_a_new_target_keeps_the_instants_of_the_steps_under_way_and_the_same_changes_nothing() -> (
    None
):
    ramp = Ramp(since=0).towards(0, 10, 2, 10)
    assert ramp.towards(14, 10, 2, 10) is ramp.towards(1000, 10, 7, 3) is ramp
    turned_round = ramp.towards(14, -10, 4, 10)
    assert [turned_round.speed(at) for at in (14, 19, 20, 30)] == [2, 2, -2, -6]
    assert turned_round.turned(20) == 2 * 10
    at_once = ramp.towards(15, 7, 1, 0)
    assert (at_once.speed(15), at_once.turned(20)) == (7, 2 * 5 + 7 * 5)


orders = st.lists(
    st.tuples(
        st.integers(0, 300),  # wait
        st.integers(-127, 127),
        st.integers(-127, 127),
        st.integers(1, 50),  # step
        st.integers(0, 30),  # period
    ),
    max_size=8,
)


@settings(max_examples=40)
@given(orders=orders, silence=st.integers(0, 400))
def test_turn_is_the_sum_over_the_stretches_whatever_the_commands(
    orders: list[tuple[int, int, int, int, int]], silence: int
) -> None:
    pair = MotorPair(0, 1, 1e9)  # a unit is 1e9 rad/s: 1 rad in 1 ns
    turned, at = [0.0, 0.0], 0

    def advance(until: int) -> None:
        nonlocal at
        for stretch in pair.stretches(at, until):
            for motor, speed in enumerate(stretch.speeds_rad_s):
                turned[motor] += speed / 1e9 * (stretch.until - stretch.since)
        at = until

    for wait, first, second, step, period in orders:
        pair.put_off_stop(at, at + silence + 1)
        advance(at + wait)
        pair.put_off_stop(at, NEVER)
        pair.drive(at, (first, second), step, period)
    advance(at + 500)
    assert pair.turned_rad(at) == pytest.approx(tuple(turned), abs=1e-6)


def test_speeds_are_shares_of_full_speed_too() -> None:
    pair = MotorPair(0, 127, 17.8)
    pair.drive(0, (127, -64), 127, 0)
    assert pair.shares(1) == (1.0, -64 / 127)


def test_stretches_fill_the_time_without_gap_and_end_in_one_of_rest() -> None:
    pair = MotorPair(0, 127, 127.0)
    pair.drive(0, (2, -1), 1, 10)
    pair.put_off_stop(0, 45)
    stretches = list(pair.stretches(0, 1_000_000_000))
    assert [(s.since, s.until, s.speeds_rad_s) for s in stretches] == [
        (0, 10, (0, 0)),
        (10, 20, (1, -1)),
        (20, 45, (2, -1)),
        (45, 1_000_000_000, (0, 0)),
    ]
    assert all(one.until == other.since for one, other in pairwise(stretches))


def test_motors_stay_stopped_after_silence_until_driven_again() -> None:
    pair = MotorPair(0, 127, 12.7)
    pair.drive(0, (127, 127), 127, 0)
    pair.put_off_stop(0, 1_000_000_000)
    assert pair.speeds_rad_s(999_999_999) == pytest.approx((12.7, 12.7))
    assert pair.speeds_rad_s(1_000_000_000) == (0.0, 0.0)
    assert pair.put_off_stop(3_000_000_000, NEVER)
    assert pair.speeds_rad_s(3_000_000_000) == (0.0, 0.0)
    assert pair.turned_rad(9_000_000_000) == pytest.approx((12.7, 12.7))


def test_before_change_sees_the_old_future_and_only_real_changes() -> None:
    pair = MotorPair(0, 10, 10.0)
    seen: list[float] = []
    pair.before_change = lambda: seen.append(pair.turned_rad(1_000_000_000)[0])
    pair.drive(0, (0, 0), 10, 0)
    pair.drive(0, (10, 10), 10, 0)
    pair.drive(500_000_000, (10, 10), 10, 0)
    pair.put_off_stop(500_000_000, NEVER)
    pair.drive(500_000_000, (0, 0), 10, 0)
    assert seen == [0.0, pytest.approx(10.0)]
    assert pair.turned_rad(1_000_000_000)[0] == pytest.approx(5.0)


def test_the_time_before_the_last_change_is_gone() -> None:
    pair = MotorPair(0, 1, math.tau)
    pair.drive(2_000_000_000, (1, 1), 1, 0)
    with pytest.raises(ValueError, match=r"1\.500000000 s, .* 2\.000000000 s"):
        pair.turned_rad(1_500_000_000)


def test_manual_clock_stands_still_until_advanced_and_does_not_go_back() -> None:
    clock = ManualClock(5)
    assert clock() == 5
    clock.advance(20)
    clock.advance(0)
    assert clock() == 25
    with pytest.raises(ValueError, match="advanced by -1 ns"):
        ManualClock().advance(-1)


def test_warnings_name_their_chip_the_first_hundred_are_kept_and_all_counted() -> None:
    warnings = ProtocolWarnings("PCA9685 0x40")
    warnings.note("PRE_SCALE written awake; the real chip ignores it")
    assert warnings == ["PCA9685 0x40: PRE_SCALE written awake; the real chip ignores it"]
    warnings = ProtocolWarnings("chip")
    for number in range(250):
        warnings.note(str(number))
    assert (len(warnings), warnings[-1], warnings.total) == (100, "chip: 99", 250)


def test_the_first_warning_of_each_kind_is_kept_however_many_came_before() -> None:
    warnings = ProtocolWarnings("chip")
    for number in range(250):
        warnings.note(f"accessed {number / 10} ms too early, register 0x{number:02x}")
    warnings.note("EXTCLK set; the real chip keeps it until a reset")
    warnings.note("mode 3 does not exist")
    warnings.note("mode 5 does not exist")
    assert warnings[100:] == [
        "chip: EXTCLK set; the real chip keeps it until a reset",
        "chip: mode 3 does not exist",
    ]
    assert warnings.total == 253
    warnings = ProtocolWarnings("chip")
    for number in range(150):
        packet = bytes((0x80, number, 0x3F))
        warnings.note(f"packet {packet.hex(' ')} has a wrong checksum; it is ignored")
    assert len(warnings) == 100
