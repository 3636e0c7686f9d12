"""The robot that runs in a process, and what other processes may know of it."""

import pytest

from firmware_runtime.board import registry
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.interlock import always_enabled
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.local_robot import LocalRobot, local_robot
from firmware_runtime.runs.recorded_edge import RecordedEdge


def tachobot(*, has_ports: bool) -> LocalRobot:
    board, clock = registry.load("tachobot"), VirtualClock()
    hardware = Hardware(board, clock, True, always_enabled, is_here=True)
    edge = RecordedEdge(board, clock, None, print)
    return local_robot(board, hardware, None, edge, None, has_ports=has_ports)


@pytest.mark.parametrize(("is_here", "now"), [(True, 5), (False, 7)])
def test_own_doubles_live_in_the_instant_of_a_step_and_what_is_elsewhere_in_that_of_the_clock(
    *, is_here: bool, now: int
) -> None:
    clock = VirtualClock()
    hardware = Hardware(registry.load("tachobot"), clock, is_here, always_enabled, is_here=is_here)
    hardware.world_now.begin(5, 5)
    clock.start(7)
    assert hardware.world_now() == now


def test_a_robot_for_others_lists_its_ports_and_none_of_the_world_of_its_doubles() -> None:
    local = tachobot(has_ports=True)
    assert local.ports is not None
    listed = {each["name"] for each in local.ports.listing()}
    assert {"yaw_reference", "imu.sample"} <= listed
    assert not [each for each in listed if each.startswith("world")]
    assert "world" in local.robot.model.components


def test_a_robot_that_no_other_process_finds_has_none() -> None:
    assert tachobot(has_ports=False).ports is None
