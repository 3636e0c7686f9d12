"""Two nodes for one robot, or two robots of one name: who is refused, and what is said."""

from pathlib import Path

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from firmware_runtime.errors import Status
from firmware_runtime.links.ros2.__main__ import topics_of_plan
from firmware_runtime.links.ros2.diagnostics import Diagnostics
from firmware_runtime.links.ros2.node import RobotNode
from firmware_runtime.links.ros2.only_active import OnlyActive
from firmware_runtime.links.ros2.services import Services
from tests.ros2.test_lifecycle import NODE, PATIENT, activate, activate_again, is_armed, started
from tests.ros2.test_stale_commands import STATE
from tests.support.bridged_run import line
from tests.support.replies import Replies
from tests.support.ros_processes import FREE, ROS_VENV, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until


def test_a_second_node_of_a_run_is_refused_until_the_first_has_gone(robot: RosProcesses) -> None:
    first = robot.node()
    second = robot.start("ros2", "tachobot", "--venv", str(ROS_VENV))
    assert f"(process {first.pid}); expected one" in line(second, "expected one")
    assert second.wait() == Status.BAD_INPUT
    first.kill()
    first.wait()
    robot.node()


def test_a_node_whose_names_another_has_arms_nothing_and_says_so(
    node: RobotNode, user: RosUser, tmp_path: Path
) -> None:
    Services(node)
    Diagnostics(node, topics_of_plan(node, node.plan))
    assert node.namesakes == ""
    user.node.create_service(Trigger, "/parrot/arm", lambda _, response: response)
    wait_until(lambda: node.namesakes != "", "the other is found")
    with Replies(tmp_path / "parrot.stats") as run:
        run.answer_in_background(STATE)
        node.trigger_configure()
        run.wait()
        node.trigger_activate()
        assert node.phase == "inactive"
        assert "/parrot/arm too" in node.refusal
        assert not any('"arm"' in each for each in run.requests())
    said: list[DiagnosticArray] = []
    user.node.create_subscription(DiagnosticArray, "/diagnostics", said.append, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def is_said() -> bool:
        executor.spin_once(timeout_sec=0.01)
        statuses = [each for array in said for each in array.status]
        return any("/parrot/arm too" in each.message for each in statuses)

    user.spin_until(is_said, "diagnostics say so")
    executor.shutdown()


def test_of_two_nodes_of_one_name_that_are_active_each_disarms_its_robot(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot, *FREE)
    node = robot.node(*PATIENT)
    activate(user)
    for _ in range(3):  # its own mark, made anew each time, is none of another
        assert user.change(NODE, "deactivate")
        activate_again(user)
    user.node.create_service(Trigger, "/tachobot/arm", lambda _, response: response)
    line(node, "another node of this domain")
    assert user.state(NODE) == "active"
    assert is_armed(robot)
    mark = user.node.create_publisher(Empty, "/tachobot/_active", 1)
    line(node, "another active node of this domain")
    wait_until(lambda: user.state(NODE) == "inactive", "the node is inactive")
    assert not is_armed(robot)
    assert not user.change(NODE, "activate")
    user.node.destroy_publisher(mark)


def test_a_node_takes_its_own_mark_for_no_others_and_keeps_it_once_it_has_found_another(
    node: RobotNode, user: RosUser, monkeypatch: pytest.MonkeyPatch
) -> None:
    deactivated: list[bool] = []
    monkeypatch.setattr(node, "trigger_deactivate", lambda: deactivated.append(True))
    phases = iter(["active", "inactive"] * 200)
    monkeypatch.setattr(RobotNode, "phase", property(lambda _: next(phases, "active")))
    only = OnlyActive(node)
    for _ in range(200):
        only.activate()
        only.follow(0)
        only.deactivate()
        only.follow(0)
    assert deactivated == []
    only.activate()
    other = user.node.create_publisher(Empty, "/parrot/_active", 1)
    wait_until(lambda: node.count_publishers("_active") == 2, "the other is found")
    only.follow(0)
    assert deactivated == [True]
    only.deactivate()
    assert node.count_publishers("_active") == 2
    only.clean_up()
    wait_until(lambda: node.count_publishers("_active") == 1, "the mark is gone")
    user.node.destroy_publisher(other)
