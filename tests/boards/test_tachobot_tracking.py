"""TachoBot in mode `track`, whole, on its doubles in virtual time."""

import math
from contextlib import suppress
from itertools import pairwise
from typing import Any

import pytest
from firmware_boards.tachobot.tracking import TrackingController
from firmware_drivers.thrust_pairs import Forces

from firmware_runtime import open_board
from firmware_runtime.board import registry
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError
from firmware_runtime.hal.strike import Strike
from firmware_runtime.models.position_fix import PositionState
from tests.support.virtual_tachobot import VirtualTachobot, virtual_tachobot

pytestmark = pytest.mark.slow

WORLD = ("world.accelerometer_noise_m_s2=0.05", "world.accelerometer_bias_m_s2=0.05")


def tracking(*assignments: str, checked: bool = False) -> VirtualTachobot:
    return virtual_tachobot("controller.mode=track", *WORLD, *assignments, checked=checked)


def states(robot: VirtualTachobot) -> list[tuple[float, PositionState]]:
    return [(at / SECOND, state) for at, state in robot.received["controller.watch.state"]]


def errors(robot: VirtualTachobot, after_s: float) -> tuple[list[float], list[float]]:
    """How far the body really is from its setpoints, m, and how far its yaw is, rad."""
    received = robot.received
    goals = [dict(received[f"controller.trajectory.{axis}"]) for axis in ("x", "y", "yaw")]
    true = [dict(received[f"world.{port}"]) for port in ("x", "y", "yaw_rad")]
    instants = [at for at in goals[0] if at in true[0] and at > after_s * SECOND]
    off = [
        math.hypot(*(goals[n][at].position - true[n][at].position for n in (0, 1)))
        for at in instants
    ]
    return off, [goals[2][at].position - true[2][at] for at in instants]


def test_it_follows_a_circle_of_one_metre_within_two_centimetres_and_turns_with_it() -> None:
    robot = tracking("trajectory.kind=circle", "trajectory.turns=true")
    robot.run(35.0)
    off, yaw = errors(robot, after_s=18.0)
    assert max(off) < 0.02
    assert max(map(abs, yaw)) < 0.02
    assert robot.faults() == []
    assert robot.rig.result(35 * SECOND, {})["settled"] is True


def test_it_holds_a_place_with_its_yaw_measured_too() -> None:
    place = ("trajectory.x_m=0.3", "trajectory.y_m=-0.2", "trajectory.yaw_rad=0.4")
    robot = tracking(*place, "world.position.yaw=true")
    robot.run(20.0)
    state = robot.rig.world.state(round(20.1 * SECOND))
    assert (state.x_m, state.y_m, state.yaw_rad) == pytest.approx((0.3, -0.2, 0.4), abs=0.02)


def test_a_line_is_driven_to_its_end() -> None:
    robot = tracking("trajectory.kind=line", "trajectory.x_m=1.0", "trajectory.y_m=0.5")
    robot.run(25.0)
    state = robot.rig.world.state(round(25.1 * SECOND))
    assert (state.x_m, state.y_m) == pytest.approx((1.0, 0.5), abs=0.02)


def test_half_of_the_positions_dropped_is_followed_still() -> None:
    robot = tracking("trajectory.kind=circle", "world.position.dropout=0.5")
    robot.run(27.0)
    assert max(errors(robot, after_s=18.0)[0]) < 0.05


def test_without_a_position_it_cannot_be_armed_and_no_propeller_turns() -> None:
    robot = tracking("world.position.rate_hz=0")
    assert {"position", "pose"} <= set(robot.model.in_ports)
    assert "yaw_reference" not in robot.model.in_ports
    assert "position" not in virtual_tachobot().model.in_ports
    robot.run(6.0)
    assert isinstance(robot.model.controller, TrackingController)
    assert robot.model.controller.estimator.unready() == "has no position"
    assert robot.values("controller.allocation.forces") == []
    assert robot.rig.thrust.all_off


def test_an_outage_that_ends_before_it_begins_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"outages_s: 5\.0 s to 2\.0 s, expected an end after"):
        tracking("world.position.outages_s=[[5.0, 2.0], [6.0, 7.0]]")


def test_arming_is_refused_without_a_position_and_granted_with_one() -> None:
    for rate_hz, armed in ((0.0, False), (20.0, True)):
        settings = {
            "controller.mode": "track",
            "world.position.rate_hz": rate_hz,
            "arming.demand_guard": False,
            "executive.fifo_priority": 0,
        }
        chosen: dict[str, Any] = {"doubles": True, "supervised": True, "arm": True}
        with open_board("tachobot", clock="virtual", set=settings, **chosen) as robot:
            with suppress(FirmwareRuntimeError):  # a run that was never ready has failed
                robot.run(for_s=4.0)
            assert robot.was_armed is armed
            assert ("has no position" in (robot.why_not_armed or "")) is not armed
            assert ("receives no position" in (robot.why_not_armed or "")) is not armed


def test_outputs_are_not_armed_while_no_position_is_received_nor_lifted_at_the_first() -> None:
    robot = tracking("world.position.outages_s=[[1.0, 3.0]]")
    gate = robot.model.position_input
    for until_s, unready in ((0, 1), (1.5, 0), (2.5, 1), (3.5, 0)):
        robot.run(until_s)
        assert gate.unready() == ("receives no position" if unready else None)
        if until_s == 1.5:
            assert isinstance(robot.model.controller, TrackingController)
            assert robot.model.controller.estimator.unready() is None
            assert robot.values("controller.allocation.forces") == []


def test_a_position_that_stops_for_two_seconds_is_braked_for_and_resumed_without_a_jump() -> None:
    robot = tracking("trajectory.kind=circle", "world.position.outages_s=[[22.0, 24.0]]")
    robot.run(22.0)
    off, yaw = errors(robot, after_s=18.0)
    assert max(off) < 0.02
    assert max(map(abs, yaw)) < 0.02
    assert robot.faults() == []
    robot.run(45.0)
    assert [state for _, state in states(robot)] == [
        PositionState.TRACKING,
        PositionState.COASTING,
        PositionState.LOST,
        PositionState.TRACKING,
    ]
    lost_s, returned_s = states(robot)[2][0], states(robot)[3][0]
    assert lost_s == pytest.approx(23.05, abs=0.06)
    assert returned_s == pytest.approx(24.06, abs=0.06)
    for axis in ("x", "y", "yaw"):
        setpoints = robot.received[f"controller.trajectory.{axis}"]
        returned = [each for at, each in setpoints if at > returned_s * SECOND]
        assert all(
            abs(b.position - a.position - 0.02 * a.rate) < 2e-4 for a, b in pairwise(returned)
        )
    off, yaw = errors(robot, after_s=returned_s)
    assert max(off) < 0.1
    assert max(map(abs, yaw)) < 0.05
    assert max(errors(robot, after_s=40.0)[0]) < 0.03


def test_a_lost_position_stops_the_robot_keeps_its_yaw_and_ends_the_run_at_last() -> None:
    robot = tracking("trajectory.kind=circle", "world.position.outages_s=[[22.0, 99.0]]")
    robot.run(24.8)
    state = robot.rig.world.state(round(24.805 * SECOND))
    assert math.hypot(state.vx_m_s, state.vy_m_s) < 0.05
    assert state.yaw_rad == pytest.approx(1.0, abs=0.05)
    assert not robot.rig.thrust.all_off
    robot.run(26.0)
    ((at, ending),) = robot.received["controller.given_up.ended"]
    assert at / SECOND == pytest.approx(25.0, abs=0.06)
    assert ending == ("no position for 3 s", True)
    assert robot.rig.thrust.all_off


def test_a_position_that_is_lost_again_soon_ends_the_run_and_one_lost_later_does_not() -> None:
    twice = tracking("world.position.outages_s=[[10.0, 11.5], [15.0, 16.5]]")
    twice.run(20.0)
    ((at, ending),) = twice.received["controller.given_up.ended"]
    assert at / SECOND == pytest.approx(16.0, abs=0.06)
    assert ending == ("the position was lost twice within 10 s", True)
    later = tracking("world.position.outages_s=[[10.0, 11.5], [22.0, 23.5]]")
    later.run(26.0)
    assert later.received["controller.given_up.ended"] == []
    assert states(later)[-1][1] is PositionState.TRACKING


def test_an_accelerometer_that_lies_for_ever_is_said_and_leads_nowhere() -> None:
    lies = Strike("negate", "imu", at_s=9.0, amount=0.0)
    mode = {"controller.mode": "track"}
    with open_board("tachobot", doubles=True, clock="virtual", set=mode, faults=[lies]) as robot:
        ended = robot.run(40.0)
        assert "the position was lost twice" in ended.reason
        assert robot.rig is not None
        assert not any(robot.rig.outputs.values())
        state = robot.world.state(robot.now)
    assert math.hypot(state.x_m, state.y_m) < 2.0


def test_a_saturated_position_command_leaves_yaw_what_it_asks_for() -> None:
    """Gains far beyond what the pairs give: x and y are cut, yaw is held all the same."""
    robot = tracking(
        "trajectory.kind=circle", "controller.x.kp=200", "controller.y.kp=200",
        "controller.x.kd=60", "controller.y.kd=60", "world.position.noise_m=0.05",
        "position.noise_m=0.05",
    )  # fmt: skip
    robot.run(20.0)
    forces: list[Forces] = robot.values("controller.allocation.forces")
    commands = robot.values("controller.yaw.command_n")
    saturated = 0
    for each, command in zip(forces[-1000:], commands[-1000:], strict=True):
        f1, f2, f3, f4 = each
        assert (f1 - f2 + f3 - f4) / 2 == pytest.approx(command, abs=1e-9)
        assert max(map(abs, each)) <= 0.4 + 1e-9
        saturated += max(map(abs, each)) > 0.4 - 1e-9
    assert saturated > 100
    assert robot.rig.world.state(round(20.1 * SECOND)).yaw_rad == pytest.approx(1.0, abs=0.1)


def test_the_same_seeds_give_the_same_values() -> None:
    runs = []
    for seed in (1, 1, 2):
        robot = tracking(f"world.position.seed={seed}")
        robot.run(2.5)
        runs.append(robot.received)
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]


@pytest.mark.parametrize(
    ("assignments", "fault"),
    [
        (["position.brake_after_s=0.1"], "position.coast_after_s"),
        (["trajectory.kind=circle", "trajectory.lap_s=8"], "all that two pairs give"),
        (["trajectory.kind=circle", "trajectory.radius=2"], "trajectory.radius"),
        (["trajectory.kind=spiral"], "trajectory.kind"),
        (["trajectory.kind=line"], "trajectory.x_m"),
        (["trajectory.kind=line", "trajectory.x_m=0.0", "trajectory.y_m=0.0"], "no length"),
        (["trajectory.kind=file", "trajectory.file=/nowhere.csv"], "trajectory.file"),
        (["trajectory.lap_s=8"], "trajectory.lap_s"),
        (["controller.yaw.smith.delay_s=0.1"], "controller.yaw.smith"),
        (["world.position.dropout=1.5"], "world.position.dropout"),
    ],
)
def test_settings_that_cannot_be_are_refused(assignments: list[str], fault: str) -> None:
    with pytest.raises(ConfigError, match=fault):
        registry.load("tachobot", ["controller.mode=track", *assignments])


@pytest.mark.parametrize(("noise_m", "seed"), [(0.02, 1), (0.05, 3)])
def test_positions_much_noisier_than_it_is_told_are_given_up_not_followed(
    noise_m: float, seed: int
) -> None:
    """One that begins the filter again is no return from a lost position by itself."""
    noisy = (f"world.position.noise_m={noise_m}", f"world.position.seed={seed}")
    robot = tracking("trajectory.x_m=0.0", "trajectory.y_m=0.0", *noisy)
    until_s = 0.0
    with suppress(FirmwareRuntimeError):
        while until_s < 60.0 and PositionState.SAFE not in dict(states(robot)).values():
            until_s += 5.0
            robot.run(until_s)
    assert states(robot)[-1][1] is PositionState.SAFE
    result: dict[str, Any] = robot.rig.result(robot.simulator.now, {})
    assert result["settled"] is False
    assert "too far from where they were expected" in result["settled_reason"]
    state = robot.rig.world.state(robot.simulator.now + SECOND // 10)
    assert math.hypot(state.x_m, state.y_m) < 1.0


def test_a_run_that_ends_on_its_way_back_to_the_path_is_off_it() -> None:
    """While it brakes its setpoint is itself, and then one that leads from itself to the path."""
    robot = tracking("trajectory.x_m=5.0")
    robot.run(8.0)
    result: dict[str, Any] = robot.rig.result(8 * SECOND, {})
    assert result["position"] == "tracking"
    assert result["settled"] is False
    assert 1.0 < result["off_m"] < 5.0
