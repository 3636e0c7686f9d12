"""Stage 2 over ROS 2, by one command: both ends, their carriers with real rclpy, one result."""

import json
from pathlib import Path

from tests.support.ros_processes import ROS_VENV, RosProcesses
from tests.support.waiting import PATIENCE_S

STAGE = ("run", "tachobot", "--stage", "network", "--link", "ros2", "--json", "--for", "6")


def test_tachobot_turns_to_its_reference_over_topics(robot: RosProcesses) -> None:
    run = robot.start(*STAGE, FIRMWARE_RUNTIME_ROS_VENV=str(ROS_VENV))
    out, _ = run.communicate(timeout=2 * PATIENCE_S)
    assert run.returncode == 0, out.decode()
    document = json.loads(out.decode().splitlines()[-1])
    assert document["link"]["over"] == "ros2"
    assert document["link"]["out"]["received"] > 0
    assert not any(document["outputs_on"].values())
    assert abs(document["result"]["yaw_error_rad"]) < 0.2


def test_a_certificate_of_a_stage_over_topics_has_no_difference(
    robot: RosProcesses, tmp_path: Path
) -> None:
    output = tmp_path / "certificate.json"
    words = ("continuity", "tachobot", "--stages", "network", "--link", "ros2", "--for", "3")
    made = robot.start(*words, "-o", str(output), FIRMWARE_RUNTIME_ROS_VENV=str(ROS_VENV))
    out, _ = made.communicate(timeout=2 * PATIENCE_S)
    assert made.returncode == 0, out.decode()
    stage = json.loads(output.read_text())["stages"]["network"]
    assert stage["link"]["over"] == "ros2"
    assert stage["events"] > 0
    assert stage["identical"] is True
