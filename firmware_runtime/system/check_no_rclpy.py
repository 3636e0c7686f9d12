"""What must not be in the environment of a process that a robot depends on: rclpy.

Its wheels start every interpreter of their environment twice, and bring a hundred packages that a
run does not need. So the node of ROS 2 has an environment of its own, and a run refuses that one.
What PYTHONPATH adds, as a shell has it in which ROS was sourced, is in no environment: a run
imports nothing of it.
"""

import os
import site

from firmware_runtime.errors import ConfigError


def refuse_ros() -> None:
    """Raise ConfigError where rclpy is installed beside this project; 20 us."""
    for folder in site.getsitepackages():
        if os.path.isdir(f"{folder}/rclpy"):  # noqa: PTH112 -- pathlib takes three times as long
            raise ConfigError.of_one(
                folder,
                "has rclpy",
                expected="a run in an environment without it, and the node of ROS 2 in one of "
                "its own: docs/ros2.md",
            )
