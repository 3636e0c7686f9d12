"""The gains and limits of a run as parameters of its node."""

from typing import Any

from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter as Value

from firmware_runtime.links.control import ask
from tests.ros2.test_lifecycle import NODE, started
from tests.support.ros_processes import RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until

KP, KI = "controller.yaw.kp", "controller.yaw.ki"
LIMIT = "thrust_pairs.timeout_s"


def value(name: str, of: object) -> Parameter:
    made: ParameterValue = Value(name, value=of).get_parameter_value()
    return Parameter(name=name, value=made)


def in_run(robot: RosProcesses) -> dict[str, Any]:
    values: dict[str, Any] = ask(robot.statistics, "get")["values"]
    return values


def in_node(user: RosUser, name: str) -> float:
    (found,) = user.call(GetParameters, f"{NODE}/get_parameters", names=[name]).values
    return float(found.double_value)


def test_parameters_are_those_of_the_run(robot: RosProcesses, user: RosUser) -> None:
    started(robot)
    robot.node()
    assert user.change(NODE, "configure")

    def set_(*parameters: Parameter) -> list[Any]:
        name = f"{NODE}/set_parameters"
        return list(user.call(SetParameters, name, parameters=list(parameters)).results)

    results = set_(value(KP, 0.5), value(KI, 0.02))
    assert [each.successful for each in results] == [True, True]
    before = in_run(robot)
    assert (before[KP], before[KI]) == (0.5, 0.02)
    for name, refused in ((KP, -1.0), (LIMIT, 0.001), (KP, "much")):
        (result,) = set_(value(name, refused))
        assert not result.successful
        assert result.reason
        assert in_run(robot) == before, "one that is out of range is refused"
    wanted = [value(KP, 0.6), value(LIMIT, 0.001)]
    result = user.call(
        SetParametersAtomically, f"{NODE}/set_parameters_atomically", parameters=wanted
    ).result
    assert not result.successful
    assert "two control periods" in result.reason
    assert in_run(robot) == before, "several are set all or none"
    assert in_node(user, KP) == before[KP]
    (found,) = user.call(
        DescribeParameters, f"{NODE}/describe_parameters", names=[LIMIT]
    ).descriptors
    (limits,) = found.floating_point_range
    assert (limits.from_value, limits.to_value) == (0.0, 1e9)
    assert "switched off" in found.description
    assert found.additional_constraints.startswith("above 0")
    assert ask(robot.statistics, "set", values={KP: 0.25})["refused"] == []
    wait_until(lambda: in_node(user, KP) == 0.25, "the node has followed")


def test_an_override_of_the_command_line_is_set_in_the_run(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot)
    robot.node("--ros-args", "-p", f"{KP}:=0.4")
    assert user.change(NODE, "configure")
    assert in_run(robot)[KP] == 0.4


def test_an_override_that_the_run_refuses_refuses_configuration(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot)
    robot.node("--ros-args", "-p", f"{LIMIT}:=0.001")
    assert not user.change(NODE, "configure")
    assert user.state(NODE) == "unconfigured"
