"""The ROS 2 workspace, built by real colcon: what it installs is found and becomes a robot's node.

`ros2 launch` and `ros2 run` are in no wheel; their part, which is to look up the package and to
start its executable with the launch file's words, is played here.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from tests.ros2.test_lifecycle import NODE, started
from tests.support.bridged_run import line
from tests.support.ros_processes import PYTHON, ROOT, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.waiting import PATIENCE_S, wait_until

PACKAGE = "firmware_runtime_ros2"
LAUNCHED = ("tachobot", "--autostart", "--lease", "20", "--ros-args")
"""What the launch file starts the node with; launch itself adds the last."""
FIND = f"from ament_index_python import get_package_prefix as p; print(p('{PACKAGE}'))"


def built(folder: Path) -> Path:
    """The workspace, copied there and built as docs/ros2.md says."""
    workspace = shutil.copytree(ROOT / "ros2", folder / "ros2")
    colcon = Path(sys.executable).with_name("colcon")
    environment = {**os.environ, "COLCON_HOME": str(folder / "colcon")}
    done = subprocess.run(
        [colcon, "build"],
        cwd=workspace,
        env=environment,
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 package finished" in done.stdout
    return workspace / "install"


def test_a_workspace_that_colcon_has_built_starts_the_node_of_a_robot(
    robot: RosProcesses, user: RosUser, tmp_path: Path
) -> None:
    install = built(tmp_path)
    in_workspace = ["/bin/sh", "-c", '. "$0" && exec "$@"', str(install / "setup.sh")]
    found = subprocess.run(
        [*in_workspace, sys.executable, "-c", FIND], capture_output=True, text=True, check=True
    )
    prefix = Path(found.stdout.strip())
    assert prefix == install / PACKAGE
    assert (prefix / f"share/{PACKAGE}/launch/robot.launch.py").is_file()
    assert (prefix / f"share/{PACKAGE}/package.xml").is_file()
    executable = prefix / f"lib/{PACKAGE}/robot"
    node = robot.start_words(
        [*in_workspace, str(executable), *LAUNCHED],
        FIRMWARE_RUNTIME_PROGRAM=str(Path(PYTHON).with_name("firmware-runtime")),
    )
    line(node, "is up")
    started(robot)
    wait_until(lambda: user.state(NODE) == "inactive", "the node has configured itself")
