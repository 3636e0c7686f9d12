"""`firmware-runtime ros2 BOARD`: a running robot as a node of ROS 2."""

import argparse
import os
import sys
from pathlib import Path

from firmware_runtime.board.registry import is_name
from firmware_runtime.board.ros.topic_table import table_of
from firmware_runtime.board.ros.topics import topics_of
from firmware_runtime.board.setting_descriptions import described
from firmware_runtime.cli.arguments import SubParsers, add_board, add_statistics, add_verb, positive
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import Status
from firmware_runtime.links.ros2.interpreter import check_surroundings, find_environment, start
from firmware_runtime.links.ros2.plan import LEASE_S, Plan
from firmware_runtime.runs.requests import LONGEST_S, SHORTEST_S
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.system.this_process import keep_off

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
        "--lease",
        type=_lease,
        default=LEASE_S,
        metavar="SECONDS",
        help=f"disarm when the node gives no sign for so long; default {LEASE_S:g}",
    )
    verb.add_argument(
        "--doubles",
        type=Path,
        metavar="PATH",
        help="what the service safe_state switches off: the doubles that are served at PATH",
    )
    add_statistics(verb)
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
    keep_off(board.settings.executive.cpus)
    environment = find_environment(arguments.venv)
    check_surroundings(os.environ)
    plan = Plan(
        board=board.name,
        source=arguments.board if is_name(arguments.board) else str(board.source.absolute()),
        assignments=tuple(arguments.assignments),
        settings=described(board.settings, board.retunable),
        topics=table_of(topics_of(board)),
        statistics=str((arguments.statistics or default_path(board.name)).absolute()),
        program=(sys.executable, "-m", "firmware_runtime.cli"),
        doubles=None if arguments.doubles is None else str(arguments.doubles.absolute()),
        configures_itself=arguments.autostart,
        lease_s=arguments.lease,
    )
    ros = ["--ros-args", *arguments.ros_args] if arguments.ros_args else []
    start(environment, ["-m", "firmware_runtime.links.ros2", plan.written(), *ros])
    return Status.OK


def _lease(text: str) -> float:
    """A time of the command line that a run takes."""
    seconds = positive(text, LONGEST_S)
    if seconds < SHORTEST_S:
        raise argparse.ArgumentTypeError(f"{text!r}: expected seconds, from {SHORTEST_S:g} on")
    return seconds
