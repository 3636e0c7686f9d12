import signal

from tests.support.bridged_run import line
from tests.support.ros_processes import RosProcesses, stop
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until

NODE = "/tachobot/tachobot"


def test_a_node_is_configured_only_when_its_run_is_there(
    robot: RosProcesses, user: RosUser
) -> None:
    node = robot.node()
    assert user.state(NODE) == "unconfigured"
    assert not user.change(NODE, "configure")
    assert "no run listens" in line(node, "configure refused")
    robot.run()
    wait_until(robot.statistics.with_suffix(".ports").exists, "the run is there")
    assert user.change(NODE, "configure")
    assert user.state(NODE) == "inactive"


def test_a_signal_ends_a_node_quietly(robot: RosProcesses) -> None:
    for number in (signal.SIGTERM, signal.SIGINT):
        status, printed = stop(robot.node(), number)
        assert (status, printed) == (0, "")
