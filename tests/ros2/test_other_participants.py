"""What every participant of the domain may send: none of it ends a node or stops its clock."""

from pathlib import Path

import pytest
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter as Value

from firmware_runtime.links.ros2.__main__ import topics_of_plan
from firmware_runtime.links.ros2.node import RobotNode
from tests.ros2.test_lifecycle import NODE
from tests.support.bridged_run import line
from tests.support.parrot_node import spinning
from tests.support.replies import Replies
from tests.support.ros_processes import RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import PATIENCE_S, wait_until


def test_a_request_that_rclpy_cannot_read_ends_no_node(robot: RosProcesses, user: RosUser) -> None:
    node = robot.node()
    client = user.node.create_client(SetParameters, f"{NODE}/set_parameters")
    assert client.wait_for_service(PATIENCE_S)
    of_no_type = Parameter(name="controller.yaw.kp", value=ParameterValue(type=77))
    client.call_async(SetParameters.Request(parameters=[of_no_type]))
    line(node, "not handled: ValueError")
    assert user.state(NODE) == "unconfigured"
    assert node.poll() is None


def test_a_clock_of_ros_that_stands_still_keeps_no_node_from_its_run(
    node: RobotNode, tmp_path: Path
) -> None:
    """All may set use_sim_time; nothing publishes /clock here."""
    node.set_parameters([Value("use_sim_time", value=True)])
    with Replies(tmp_path / "parrot.stats") as run, spinning(node) as until:
        until(run.has_request)


@pytest.mark.parametrize("node", [["--ros-args", "-r", "cmd_vel:=/mux/cmd_vel"]], indirect=True)
def test_a_topic_that_is_remapped_is_so_for_each_of_its_types(
    node: RobotNode, user: RosUser, tmp_path: Path
) -> None:
    """Or commands that were to go past a multiplexer would drive the robot by the other type."""
    topics = topics_of_plan(node, node.plan)
    with Replies(tmp_path / "parrot.stats"):
        topics.configure()

        def taken(topic: str) -> list[str]:
            found = user.node.get_subscriptions_info_by_topic(topic)
            return sorted(each.topic_type for each in found)

        both = ["geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"]
        wait_until(lambda: taken("/mux/cmd_vel") == both, "both are taken there")
        assert taken("/parrot/cmd_vel") == []
        topics.clean_up()
