"""`firmware-runtime ros2 BOARD`: a running robot as a node of ROS 2."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.links.ros2.interpreter import find_environment, start
from firmware_runtime.links.ros2.plan import Plan
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.status import Status

_ABOUT = """
The node is a process of its own, with the interpreter of an environment that has rclpy: that of
--venv, or the one that $FIRMWARE_RUNTIME_ROS_VENV names, or .venv-ros beside the project (`make
ros`), or /opt/firmware-runtime/ros. It speaks with the run by the run's sockets, waits for a run,
and for the next. A robot that was armed through it is disarmed when it goes.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Be a lifecycle node of ROS 2 for a running robot."
    verb = add_verb(verbs, "ros2", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    verb.add_argument("--venv", type=Path, metavar="DIR", help="the environment that has rclpy")
    verb.add_argument(
        "--autostart",
        action="store_true",
        help="configure the node as soon as there is a run; it is never activated unasked",
    )
    verb.add_argument(
        "--statistics", type=Path, metavar="FILE", help="where the run keeps its statistics"
    )
    verb.add_argument(
        "--ros-args",
        nargs=argparse.REMAINDER,
        default=[],
        metavar="...",
        help="what follows is ROS's own: remapping, parameters, log level",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Become the node's process; ConfigError says what it lacks."""
    board = chosen_board(arguments.board, arguments.assignments)
    environment = find_environment(arguments.venv)
    plan = Plan(
        board=board.name,
        statistics=str((arguments.statistics or default_path(board.name)).absolute()),
        program=(sys.executable, "-m", "firmware_runtime.cli"),
        configures_itself=arguments.autostart,
    )
    ros = ["--ros-args", *arguments.ros_args] if arguments.ros_args else []
    start(environment, ["-m", "firmware_runtime.links.ros2", plan.written(), *ros])
    return Status.OK
