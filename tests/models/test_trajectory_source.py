"""A trajectory with a body that follows it exactly, or is held where a test puts it."""

import math
from itertools import pairwise

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion, Setpoint
from firmware_runtime.models.position_fix import PositionState
from firmware_runtime.models.trajectory_paths import Circle, Pose, RejoinLimits
from firmware_runtime.models.trajectory_source import TrajectorySource
from tests.support.atomic_bench import AtomicBench

PERIOD = 20 * MILLISECOND
LIMITS = RejoinLimits(0.2, 0.1, 0.5, least_s=1.0, ramp_s=2.0)
CIRCLE = Circle(Pose(0.0, 0.0, 0.5), 1.0, 20.0)


class Follower(AtomicBench):
    """A trajectory, its setpoints by coordinate, and the body's motion as the test says."""

    def __init__(self, *, enabled: bool = True) -> None:
        super().__init__(TrajectorySource("path", CIRCLE, PERIOD, LIMITS, enabled=enabled))
        self.sent = {name: self.said[name] for name in ("x", "y", "yaw")}

    def body(self, at_ms: int, x: Motion, y: Motion, yaw: Motion, **values: object) -> None:
        self.put(at_ms, x_now=x, y_now=y, yaw_now=yaw, **values)


def assert_smooth(sent: list[tuple[float, Setpoint]], most: float) -> None:
    """No setpoint jumps: each is where the one before it goes on to."""
    for (begin, a), (end, b) in pairwise(sent):
        span_s = (end - begin) / 1e3
        assert abs(b.position - a.position - span_s * a.rate) <= most * span_s * span_s
        assert abs(b.rate - a.rate) <= most * span_s


def test_nothing_is_sent_before_there_is_a_position() -> None:
    follower = Follower()
    follower.body(50, Motion(0.0, 0.0), Motion(0.0, 0.0), Motion(0.0, 0.0))
    follower.run(500)
    assert follower.sent["x"] == []


def test_rates_and_accelerations_are_those_of_the_positions() -> None:
    follower = Follower()
    body = Motion(0.3, 0.05), Motion(-0.2, -0.02), Motion(0.4, 0.1)
    follower.body(50, *body, state=PositionState.TRACKING)
    follower.run(10_000)
    for sent in follower.sent.values():
        for (begin, a), (_, b), (end, c) in zip(sent, sent[1:], sent[2:], strict=False):
            span_s = (end - begin) / 1e3
            assert (c.position - a.position) / span_s == pytest.approx(b.rate, abs=1e-4)
            assert (c.rate - a.rate) / span_s == pytest.approx(b.acceleration, abs=1e-3)


@pytest.mark.slow
def test_it_begins_at_the_bodys_own_motion_and_reaches_the_path_without_a_jump() -> None:
    follower = Follower()
    x, y, yaw = Motion(0.3, 0.05), Motion(-0.2, -0.02), Motion(0.0, 0.0)
    follower.body(50, x, y, yaw, state=PositionState.TRACKING)
    follower.run(40_000)
    at, first = follower.sent["x"][0]
    assert at == 60
    assert first.position == pytest.approx(0.3 + 0.05 * 0.01, abs=1e-4)
    for sent in follower.sent.values():
        assert_smooth(sent, 0.5)
    x_end, y_end = follower.sent["x"][-1][1], follower.sent["y"][-1][1]
    assert math.hypot(x_end.position, y_end.position) == pytest.approx(1.0)
    assert math.hypot(x_end.rate, y_end.rate) == pytest.approx(math.tau / 20.0)
    assert follower.sent["yaw"][-1][1] == pytest.approx((0.5, 0.0, 0.0))


def test_a_lost_position_brakes_where_the_body_is_and_keeps_the_yaw() -> None:
    follower = Follower()
    follower.body(
        50, Motion(1.0, 0.0), Motion(0.0, 0.0), Motion(0.5, 0.0), state=PositionState.TRACKING
    )
    follower.run(10_000)
    follower.put(10_005, state=PositionState.COASTING)
    follower.run(11_000)
    assert follower.sent["x"][-1][1].rate != 0.0
    follower.put(11_005, state=PositionState.LOST)
    follower.body(11_010, Motion(0.7, 0.3), Motion(0.6, 0.1), Motion(0.52, 0.0))
    follower.run(11_030)
    assert follower.sent["x"][-1][1] == (0.7, 0.0, 0.0)
    assert follower.sent["y"][-1][1] == (0.6, 0.0, 0.0)
    assert follower.sent["yaw"][-1][1] == pytest.approx((0.5, 0.0, 0.0))


@pytest.mark.slow
def test_on_return_it_goes_on_from_the_body_to_where_the_path_waited() -> None:
    follower = Follower()
    begin = Motion(1.0, 0.0), Motion(0.0, 0.0), Motion(0.5, 0.0)
    follower.body(50, *begin, state=PositionState.TRACKING)
    follower.run(10_000)
    left = [sent[-1][1].position for sent in follower.sent.values()]
    follower.put(10_005, state=PositionState.LOST)
    there = Motion(left[0] + 0.3, 0.02), Motion(left[1] - 0.2, 0.0), Motion(0.45, 0.01)
    follower.body(12_005, *there)
    follower.body(14_005, *there, state=PositionState.TRACKING)
    returned = len(follower.sent["x"])
    follower.run(40_000)
    for sent, motion in zip(follower.sent.values(), there, strict=True):
        assert sent[returned][1].position == pytest.approx(motion.position, abs=1e-3)
        assert_smooth(sent[returned:], 0.5)
    gaps = [
        math.hypot(x.position - left[0], y.position - left[1])
        for (_, x), (_, y) in zip(
            follower.sent["x"][returned:], follower.sent["y"][returned:], strict=True
        )
    ]
    assert min(gaps) < 1e-3


def test_given_up_it_sends_nothing_even_if_the_position_returns() -> None:
    follower = Follower()
    begin = Motion(1.0, 0.0), Motion(0.0, 0.0), Motion(0.5, 0.0)
    follower.body(50, *begin, state=PositionState.TRACKING)
    follower.run(1000)
    follower.put(1005, state=PositionState.SAFE)
    sent = len(follower.sent["x"])
    follower.put(1500, state=PositionState.TRACKING)
    follower.run(3000)
    assert len(follower.sent["x"]) == sent


def test_it_waits_until_it_is_enabled_and_stops_when_it_is_not() -> None:
    follower = Follower(enabled=False)
    begin = Motion(1.0, 0.0), Motion(0.0, 0.0), Motion(0.5, 0.0)
    follower.body(50, *begin, state=PositionState.TRACKING)
    follower.run(1000)
    assert follower.sent["x"] == []
    follower.put(1005, enable=True)
    follower.run(2000)
    sent = len(follower.sent["x"])
    assert sent == 50
    follower.put(2005, enable=False)
    follower.run(3000)
    assert len(follower.sent["x"]) == sent


def test_a_body_that_has_turned_round_does_not_turn_back() -> None:
    follower = Follower()
    turned = Motion(3 * math.tau + 0.4, 0.0)
    follower.body(50, Motion(1.0, 0.0), Motion(0.0, 0.0), turned, state=PositionState.TRACKING)
    follower.run(10_000)
    assert follower.sent["yaw"][-1][1].position == pytest.approx(3 * math.tau + 0.5)
