"""The lifecycle node of a robot that answers what it is sent, in the test's own process."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rclpy
from rclpy.executors import SingleThreadedExecutor

from firmware_runtime.board.ros.topic_table import table_of
from firmware_runtime.board.ros.topics import topics
from firmware_runtime.board.settings import RosSettings
from firmware_runtime.links.ros2.node import RobotNode
from firmware_runtime.links.ros2.plan import Plan
from firmware_runtime.runs.requests import LONGEST_S
from tests.support.topics_run import EchoRobot
from tests.support.waiting import PATIENCE_S


@contextmanager
def spinning(node: RobotNode) -> Iterator[Callable[[Callable[[], bool]], None]]:
    """Yield a function that handles what comes to a node until something holds."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def until(true: Callable[[], bool]) -> None:
        for _ in range(100 * PATIENCE_S):
            if true():
                return
            executor.spin_once(timeout_sec=0.01)
        raise AssertionError("nothing came of it")

    yield until
    executor.shutdown()


@contextmanager
def parrot_node(directory: Path, ros: Sequence[str] = ()) -> Iterator[RobotNode]:
    """A node without parts, with these words of ROS; sockets of its run are in the directory."""
    rclpy.init(args=list(ros))
    plan = Plan(
        board="parrot",
        statistics=str(directory / "parrot.stats"),
        program=(),
        source="parrot",
        topics=table_of(topics(EchoRobot(), RosSettings(rate_hz=0.0))),
        lease_s=LONGEST_S,
    )
    made = RobotNode(plan)
    yield made
    made.run.close()
    made.destroy_node()
    rclpy.shutdown()
