"""An active node is an armed robot: the transitions, and what becomes of them on either side."""

import signal
import subprocess

import pytest
from lifecycle_msgs.msg import Transition
from std_srvs.srv import Trigger

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.links.control import ask, post
from firmware_runtime.statistics.layout import ARMED, STEPS
from firmware_runtime.statistics.reader import read_statistics
from tests.support.bridged_run import line, stop
from tests.support.ros_processes import FREE, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import wait_until

NODE = "/tachobot/tachobot"
PATIENT = ("--lease", "20")
"""Where it is not the lease that is tested, a busy machine must not end one."""


def is_armed(robot: RosProcesses) -> bool:
    return bool(read_statistics(robot.statistics).cells[ARMED])


def started(robot: RosProcesses, *words: str) -> "subprocess.Popen[bytes]":
    """A run that answers."""
    run = robot.run(*words)
    wait_until(lambda: has_begun(robot), "the run has begun")
    return run


def has_begun(robot: RosProcesses) -> bool:
    """Whether the run has made a step."""
    try:
        return read_statistics(robot.statistics).cells[STEPS] > 0
    except StatisticsFileError:
        return False


def activate(user: RosUser) -> None:
    """Configure the node and activate it."""
    assert user.change(NODE, "configure")
    activate_again(user)


def activate_again(user: RosUser) -> None:
    """Activate it; again and again while the run has not shown its rate for a second."""
    wait_until(lambda: user.change(NODE, "activate"), "the node is active")


def test_a_node_is_configured_only_when_its_run_is_there(
    robot: RosProcesses, user: RosUser
) -> None:
    node = robot.node()
    assert user.state(NODE) == "unconfigured"
    assert not user.change(NODE, "configure")
    assert "expected a run that listens there" in line(node, "configure refused")
    started(robot)
    assert user.change(NODE, "configure")
    assert user.state(NODE) == "inactive"
    assert user.change(NODE, "cleanup")
    assert user.state(NODE) == "unconfigured"


def test_an_active_node_is_an_armed_robot_and_a_transition_that_it_has_not_ends_neither(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot, *FREE)
    node = robot.node(*PATIENT)
    activate(user)
    assert not user.change_by_number(NODE, Transition.TRANSITION_CONFIGURE)
    assert "expected deactivate, shutdown" in line(node, "refused: active has no such one")
    assert not user.change_by_number(NODE, 200)
    assert not user.change(NODE, "configure")
    assert user.state(NODE) == "active"
    assert is_armed(robot)
    assert user.change_by_number(NODE, Transition.TRANSITION_DEACTIVATE)
    assert not is_armed(robot)
    assert user.state(NODE) == "inactive"
    activate_again(user)
    assert user.change(NODE, "deactivate")
    assert not is_armed(robot)


def test_activation_is_refused_with_the_sentences_of_the_run(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot, "--supervised", "--set=executive.fifo_priority=0")
    node = robot.node()
    assert user.change(NODE, "configure")
    assert not user.change(NODE, "activate")
    assert "the guard is absent" in line(node, "activate refused")
    assert user.state(NODE) == "inactive"
    assert not is_armed(robot)


@pytest.mark.parametrize("is_active", [False, True])
def test_a_node_that_is_shut_down_leaves_no_robot_armed(
    robot: RosProcesses, user: RosUser, *, is_active: bool
) -> None:
    started(robot, *FREE)
    robot.node(*PATIENT)
    if is_active:
        activate(user)
    assert user.change(NODE, "shutdown")
    assert not is_armed(robot)
    assert user.state(NODE) == "finalized"


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_node_that_dies_or_hangs_leaves_no_robot_armed(
    robot: RosProcesses, user: RosUser, number: signal.Signals
) -> None:
    run = started(robot, *FREE)
    node = robot.node("--lease", "2")
    activate(user)
    assert is_armed(robot)
    node.send_signal(number)
    wait_until(lambda: not is_armed(robot), "the robot is disarmed")
    assert "no sign for 2 s" in line(run, "disarmed:")


def test_a_signal_ends_a_node_quietly_and_disarms(robot: RosProcesses, user: RosUser) -> None:
    run = started(robot, *FREE)
    for number in (signal.SIGTERM, signal.SIGINT):
        node = robot.node(*PATIENT)
        activate(user)
        status, printed = stop(node, number)
        assert status == 0
        assert "Traceback" not in printed
        assert not is_armed(robot)
        assert "requested" in line(run, "disarmed:")


def test_a_robot_that_is_disarmed_by_another_takes_its_node_back(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot, *FREE)
    node = robot.node(*PATIENT)
    activate(user)
    post(robot.statistics, "disarm")
    assert "requested" in line(node, "the robot was disarmed")
    assert user.state(NODE) == "inactive"


def test_a_run_that_is_gone_takes_its_node_back_and_the_next_is_found(
    robot: RosProcesses, user: RosUser
) -> None:
    run = started(robot, *FREE)
    node = robot.node(*PATIENT)
    activate(user)
    run.kill()
    line(node, "the run is gone")
    wait_until(lambda: user.state(NODE) == "unconfigured", "the node is unconfigured")
    first = read_statistics(robot.statistics).header.writer
    robot.run(*FREE)
    wait_until(lambda: read_statistics(robot.statistics).header.writer != first, "the next run")
    wait_until(lambda: user.change(NODE, "configure"), "the next run is found")


def test_a_node_configures_itself_if_it_is_to_and_arms_nothing(
    robot: RosProcesses, user: RosUser
) -> None:
    robot.node("--autostart")
    started(robot, *FREE)
    wait_until(lambda: user.state(NODE) == "inactive", "the node has configured itself")
    assert not is_armed(robot)


def test_services_arm_disarm_and_say_why_not(robot: RosProcesses, user: RosUser) -> None:
    started(robot, *FREE)
    robot.node(*PATIENT)
    wait_until(lambda: bool(user.call(Trigger, "/tachobot/arm").success), "armed")
    assert is_armed(robot)
    assert user.state(NODE) == "active"
    answer = user.call(Trigger, "/tachobot/disarm")
    assert (answer.success, answer.message) == (True, "disarmed")
    assert not is_armed(robot)
    answer = user.call(Trigger, "/tachobot/safe_state")
    assert answer.success
    assert not ask(robot.statistics, "state")["armed"]


def test_services_fail_with_a_sentence_without_a_run(robot: RosProcesses, user: RosUser) -> None:
    robot.node()
    for service in ("arm", "disarm", "safe_state"):
        answer = user.call(Trigger, f"/tachobot/{service}")
        assert not answer.success
        assert answer.message
