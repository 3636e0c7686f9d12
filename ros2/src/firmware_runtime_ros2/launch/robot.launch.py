"""`ros2 launch firmware_runtime_ros2 robot.launch.py board:=tachobot`: the node of a robot."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """The node, which configures itself when there is a run; it never arms unasked."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("board", description="a board's name, or the path of its file"),
            DeclareLaunchArgument("lease", default_value="0.4", description="seconds"),
            Node(
                package="firmware_runtime_ros2",
                executable="robot",
                arguments=[
                    LaunchConfiguration("board"),
                    "--autostart",
                    "--lease",
                    LaunchConfiguration("lease"),
                ],
                output="screen",
            ),
        ]
    )
