"""The lifecycle node of a robot that answers what it is sent, in the test's own process."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import rclpy

from firmware_runtime.board.ros.topic_table import table_of
from firmware_runtime.board.ros.topics import topics
from firmware_runtime.board.settings import RosSettings
from firmware_runtime.links.ros2.node import RobotNode
from firmware_runtime.links.ros2.plan import Plan
from firmware_runtime.runs.requests import LONGEST_S
from tests.support.topics_run import EchoRobot


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
