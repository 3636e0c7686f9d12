"""Two environments: the node's has rclpy, and a run refuses it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.links.ros2.interpreter import find_environment, variables_of
from tests.ros2.test_lifecycle import NODE, started
from tests.support.bridged_run import line
from tests.support.ros_processes import PYTHON, ROOT, ROS_VENV, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.system_call_filter import HEADER

UNIT = ROOT / "systemd/firmware-runtime-ros2@.service"


@pytest.mark.parametrize("verb", ["run", "guard"])
def test_a_run_refuses_an_environment_with_rclpy(verb: str) -> None:
    words = [sys.executable, "-m", "firmware_runtime.cli", verb, "tachobot", "--doubles", "x"]
    ended = subprocess.run(words, capture_output=True, text=True, check=False)
    assert ended.returncode == Status.BAD_INPUT
    assert "has rclpy" in ended.stderr


def test_safe_state_refuses_no_environment(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "firmware_runtime.cli", "safe-state", "tachobot"]
    ended = subprocess.run(
        [*words, "--doubles", str(tmp_path / "none")], capture_output=True, text=True, check=False
    )
    assert "rclpy" not in ended.stderr


def test_the_environment_of_a_run_has_nothing_of_ros() -> None:
    words = [PYTHON, "-X", "importtime", "-m", "firmware_runtime.cli", "run", "tachobot"]
    ended = subprocess.run(
        [*words, "--doubles", "--clock", "virtual", "--for", "2"],
        capture_output=True,
        text=True,
        check=True,
    )
    imported = {line.rpartition("|")[2].strip() for line in ended.stderr.splitlines()}
    assert "firmware_runtime.runs.session" in imported
    assert not {name for name in imported if name.startswith("rclpy") or "_msgs" in name}
    assert not {name for name in imported if "links.ros2" in name}


def test_an_environment_without_rclpy_is_refused_in_a_sentence(robot: RosProcesses) -> None:
    outer = Path(PYTHON).parents[1]
    node = robot.start("ros2", "tachobot", "--venv", str(outer))
    assert "has no rclpy" in line(node, "expected rclpy and firmware-runtime in it")
    assert node.wait() == Status.BAD_INPUT


def test_no_environment_at_all_is_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(ConfigError):
        find_environment(tmp_path)


def test_the_launcher_sets_what_a_dependency_would_start_the_interpreter_again_for() -> None:
    variables = variables_of(ROS_VENV, {"LD_LIBRARY_PATH": "/mine"})
    first, *others = variables["LD_LIBRARY_PATH"].split(":")
    assert first == str(ROS_VENV / "lib")
    assert others[-1] == "/mine"
    assert any("ros_rclpy.libs" in each for each in others)
    assert variables["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"


@pytest.mark.skipif(
    shutil.which("systemd-analyze") is None or not HEADER.exists(),
    reason="needs the Debian packages systemd and linux-libc-dev",
)
def test_a_node_gets_along_with_the_system_calls_of_its_unit(
    robot: RosProcesses, user: RosUser
) -> None:
    started(robot)
    allowed = os.sched_getaffinity(0)
    given = min(allowed)
    under = [PYTHON, str(ROOT / "tests/support/system_call_filter.py"), str(UNIT)]
    node = robot.node("--set", f"executive.cpus=[{given}]", under=under)
    assert user.change(NODE, "configure")
    for thread in Path(f"/proc/{node.pid}/task").iterdir():
        assert os.sched_getaffinity(int(thread.name)) == (allowed - {given} or allowed)
