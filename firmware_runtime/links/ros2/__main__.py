"""The node's process: spins until a signal comes, in the interpreter of a ROS environment."""

import errno
import os
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from hashlib import sha256
from pathlib import Path

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from firmware_runtime.board.ros.conventions import conventions
from firmware_runtime.board.ros.topic_table import topics_in
from firmware_runtime.board.ros.topics import Topics
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status
from firmware_runtime.hal.peer import peer_of
from firmware_runtime.links.ros2.diagnostics import Diagnostics
from firmware_runtime.links.ros2.node import RobotNode
from firmware_runtime.links.ros2.only_active import OnlyActive
from firmware_runtime.links.ros2.parameters import Parameters
from firmware_runtime.links.ros2.plan import Plan, read_plan
from firmware_runtime.links.ros2.services import Services
from firmware_runtime.links.ros2.spinning import spin_once
from firmware_runtime.links.ros2.topics import RobotTopics
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import until_signal

WAIT_S = 0.1
"""The executor waits for an event no longer than this. Without a bound its loop never sleeps and
handles nothing (rclpy 7.1.6), and a signal is noticed when it returns."""


def robot_node(plan: Plan) -> RobotNode:
    """The node with all its parts."""
    node = RobotNode(plan)
    topics = topics_of_plan(node, plan)
    node.parts += [OnlyActive(node), Parameters(node), topics]
    Services(node)
    Diagnostics(node, topics)
    return node


def topics_of_plan(node: RobotNode, plan: Plan) -> RobotTopics:
    """Its topics. Raises ConfigError if a package with conventions of its own is not here."""
    found = topics_in(plan.topics, conventions()) if plan.topics else Topics()
    ports = plan.statistics_path

    def holds_robot() -> bool:
        return node.run.holds_robot and not node.has_stood_still()

    return RobotTopics(node, found, ports, holds_robot)


def main(words: Sequence[str]) -> int:
    """Spin the node of the plan in the first word; the others are ROS's own."""
    with until_signal() as signal, ExitStack() as stack:
        try:
            plan = read_plan(words[0])
            stack.enter_context(only_node_of(plan.statistics_path))
            rclpy.init(args=list(words[1:]), signal_handler_options=SignalHandlerOptions.NO)
            node = robot_node(plan)
        except Exception as error:  # noqa: BLE001 -- of ROS, which has no one root of its errors
            is_ours = isinstance(error, FirmwareRuntimeError)
            fault = str(error) if is_ours else f"{type(error).__name__}: {error}"
            print(f"firmware-runtime: ros2: {fault}", file=sys.stderr)  # noqa: T201
            return Status.BAD_INPUT
        executor = EventsExecutor()
        executor.add_node(node)
        notices = Notices.from_environment()
        notices.ready()
        said = ""
        node.get_logger().info(f"{node.get_fully_qualified_name()} is up")
        while not signal.came:
            spin_once(executor, node, WAIT_S)
            notices.alive()
            if node.phase != said:
                said = node.phase
                notices.status(said)
        notices.stopping()
        node.leave()
        executor.remove_node(node)
        node.destroy_node()
        rclpy.shutdown()
    return Status.OK


@contextmanager
def only_node_of(statistics: Path) -> Iterator[None]:
    """This process is the node of the run with these statistics, until it is left.

    A second one would take every command twice and publish every value twice. The claim is a socket
    with a name that is in no directory, so the kernel gives it up with the process, whatever that
    ended of; and the process that has it is found by a connection. Raises ConfigError if another
    process is.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as claim:
        name = _name_of(statistics)
        try:
            claim.bind(name)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise ConfigError.of_one(
                str(statistics), f"another ROS 2 node of this run is up{_holder_of(name)}", "one"
            ) from error
        claim.listen()
        yield


def _name_of(statistics: Path) -> bytes:
    told_apart = sha256(os.fsencode(statistics.resolve())).hexdigest()
    return b"\0firmware-runtime-ros2-" + told_apart[:32].encode()


def _holder_of(name: bytes) -> str:
    """Return which process has the claim, if it can be known."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK) as asking:
        try:
            asking.connect(name)
            return f" (process {peer_of(asking).process})"
        except OSError:
            return ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
