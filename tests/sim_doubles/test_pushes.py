"""Robots that are pushed: what changes at once, by how much, and when it was to happen."""

import math

import pytest

from firmware_runtime import ConfigError, Strike, open_board
from firmware_runtime.devs.time import SECOND
from firmware_runtime.runs.open_board import OpenBoard
from sim_doubles.rigs.tachobot import TachobotRig

BEFORE_S = 0.3
"""Nothing is driven yet: the gyro's bias is being measured."""


def opened(board: str, *faults: Strike, **settings: object) -> OpenBoard:
    given = {key.replace("__", "."): value for key, value in settings.items()}
    return open_board(board, doubles=True, clock="virtual", set=given, faults=faults)


def yaw_rate(robot: OpenBoard) -> float:
    rate = robot.world.state(robot.now).yaw_rate_rad_s
    assert isinstance(rate, float)
    return rate


@pytest.mark.parametrize("solver", ["exact", "qss2"])
@pytest.mark.parametrize(
    "more",
    [
        {},
        {"world__static_friction_nm": 0.05, "world__coulomb_friction_nm": 0.02},
        {"controller__mode": "free"},
    ],
    ids=["platform", "sticking", "free"],
)
def test_a_push_is_a_step_of_tachobots_yaw_rate(solver: str, more: dict[str, object]) -> None:
    with opened("tachobot", world__solver=solver, **more) as robot:
        robot.run(BEFORE_S)
        assert yaw_rate(robot) == pytest.approx(0.0, abs=1e-9)
        robot.strike("push", amount=-0.5)
        assert yaw_rate(robot) == pytest.approx(-0.5, abs=1e-4)
        robot.strike("push", amount=0.2)
        assert yaw_rate(robot) == pytest.approx(-0.3, abs=1e-4)
        robot.run(0.1)
        assert robot.world.state(robot.now).yaw_rad < 0.0


def test_tachobot_turns_faster_than_any_mission_asks_above_six_radians_a_second() -> None:
    with opened("tachobot") as robot:
        rig = robot.rig
        assert isinstance(rig, TachobotRig)
        rig.push(-5.9)
        assert rig.judge() is None
        rig.push(-0.2)
        assert rig.judge() == "it turns at -6.1 rad/s, 6 at most"


def test_a_push_of_a_script_comes_with_the_first_transaction_after_its_instant() -> None:
    with opened("tachobot", Strike("push", at_s=0.205, amount=0.5)) as robot:
        rate = robot.port("world.yaw_rate_rad_s")
        robot.run(0.2)
        assert yaw_rate(robot) == pytest.approx(0.0, abs=1e-9)
        robot.run(0.02)
        assert yaw_rate(robot) == pytest.approx(0.5, abs=1e-4)
        assert all(value == 0.0 for value in rate.values()[:20])


@pytest.mark.parametrize("solver", ["exact", "qss2"])
def test_a_push_turns_the_detective_where_it_stands_and_its_compass_sees_it(solver: str) -> None:
    with opened("detective", world__solver=solver) as robot:
        robot.run(BEFORE_S)
        before, shown = robot.world.pose(robot.now), robot.world.body_bearing_deg(robot.now)
        robot.strike("push", amount=math.pi / 2)
        after = robot.world.pose(robot.now)
        assert after.heading_rad - before.heading_rad == pytest.approx(math.pi / 2, abs=1e-4)
        assert (after.x_m, after.y_m) == pytest.approx((before.x_m, before.y_m), abs=1e-4)
        assert robot.world.pose(robot.now - SECOND // 10).heading_rad == pytest.approx(
            before.heading_rad, abs=1e-4
        )
        seen = robot.world.body_bearing_deg(robot.now)
        assert abs(seen - shown) % 360 == pytest.approx(90.0, abs=3.0)
        robot.strike("push", amount=0.5)
        again = robot.world.pose(robot.now).heading_rad
        assert again - after.heading_rad == pytest.approx(0.5, abs=1e-4)


def test_a_head_that_is_pushed_aside_goes_back() -> None:
    with opened("pan_tilt") as robot:
        robot.run(3.0)
        rig = robot.rig
        assert rig is not None
        pan = rig.pan  # type: ignore[attr-defined]  # of this rig
        angle = pan.angle_rad(robot.now)
        robot.strike("push", amount=-0.4)
        assert pan.angle_rad(robot.now) == pytest.approx(angle - 0.4, abs=1e-6)
        robot.run(0.5)
        assert pan.angle_rad(robot.now) == pytest.approx(angle, abs=0.15)


def test_a_push_has_no_device() -> None:
    with opened("tachobot") as robot, pytest.raises(ConfigError, match="without a device"):
        robot.strike("push", "imu")


@pytest.mark.parametrize("faults", ["freeze", [1], Strike("push"), [Strike("melt")]])
def test_what_is_no_script_is_refused(faults: object) -> None:
    with pytest.raises(ConfigError, match="expected"):
        open_board("tachobot", doubles=True, clock="virtual", faults=faults)  # type: ignore[arg-type]


def test_a_script_needs_doubles_of_the_runs_own() -> None:
    with pytest.raises(ConfigError, match="doubles of this run's own"):
        open_board("tachobot", faults=[Strike("push")])


def test_what_was_made_is_listed_and_ends_when_it_is_cleared() -> None:
    with opened("tachobot", Strike("absent", "imu", at_s=0.2), Strike("push", at_s=50.0)) as robot:
        robot.run(BEFORE_S)
        assert [(each.kind, each.at) for each in robot.struck] == [
            ("absent", SECOND // 5),
            ("push", 50 * SECOND),
        ]
        robot.clear_faults()
        (made,) = robot.struck
        assert made.span == robot.now - SECOND // 5
        robot.run(3.0)
        assert robot.outputs == {"thrust_pairs": 8}
