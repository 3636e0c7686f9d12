"""The two ends of a cut, over topics of ROS 2: two runs, and a carrier with real rclpy at each."""

import subprocess
from pathlib import Path

import pytest

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.reader import read_statistics
from tests.support.referee import Referee
from tests.support.ros_processes import ROS_VENV, RosProcesses
from tests.support.waiting import PATIENCE_S, wait_until

BYTES = "std_msgs/msg/UInt8MultiArray"


@pytest.fixture(autouse=True)
def _environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """The runs start their carriers in the environment of these tests."""
    monkeypatch.setenv("FIRMWARE_RUNTIME_ROS_VENV", str(ROS_VENV))


def start_end(robot: RosProcesses, role: str, *words: str) -> "subprocess.Popen[bytes]":
    options = ("--role", role, "--set=executive.fifo_priority=0", *words)
    return robot.start("run", "tachobot", *options)


def test_a_controller_drives_a_robot_over_topics(robot: RosProcesses) -> None:
    referee = Referee()
    controller = start_end(robot, "controller", "--link=ros2", "--for=600")
    wait_until(lambda: "/tachobot/link/to_robot" in referee.published(), "its carrier is there")
    assert referee.published()["/tachobot/link/to_robot"].type == BYTES
    drives = start_end(robot, "robot", "--link=ros2", "--doubles", "--for=6")
    out, _ = drives.communicate(timeout=PATIENCE_S)
    assert drives.returncode == 0, out.decode()
    assert b"link: controller of tachobot is there" in out
    assert b"armed" in out
    controller.communicate(timeout=PATIENCE_S)  # its other end is over, and so it is
    assert controller.returncode == 0


def test_frames_that_are_not_signed_do_not_reach_a_run_with_a_key(
    robot: RosProcesses, tmp_path: Path
) -> None:
    keys = [tmp_path / name for name in ("one.key", "other.key")]
    for key in keys:
        assert robot.start("new", "key", str(key)).wait(PATIENCE_S) == 0
    start_end(robot, "controller", f"--link=ros2:key={keys[0]}", "--for=600")
    drives = start_end(robot, "robot", f"--link=ros2:key={keys[1]}", "--doubles", "--for=600")

    def forged() -> int:
        try:
            figures = read_statistics(robot.statistics).figures()
        except StatisticsFileError:
            return 0
        return int(figures.as_json()["link"]["refused"]["forged"])

    wait_until(lambda: forged() > 0, "what is signed with another key is refused")
    assert drives.poll() is None
