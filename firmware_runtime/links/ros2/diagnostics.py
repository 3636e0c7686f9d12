"""`/diagnostics` once a second, in every state of the node.

What it says of the run and of the node's own topics is in `judgement`.
"""

from time import monotonic_ns
from typing import Final

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock

from firmware_runtime.links.ros2.judgement import Judge, Level, Status, TopicJudge
from firmware_runtime.links.ros2.node import RobotNode
from firmware_runtime.links.ros2.topics import RobotTopics

EVERY_S: Final = 1.0


class Diagnostics:
    """Publishes the diagnostics of one node, for as long as it lives."""

    def __init__(self, node: RobotNode, topics: RobotTopics) -> None:
        self._node = node
        self._topics = topics
        self._clock = Clock()  # the system's, as all stamps are
        self._has_namesakes = False
        self._topic_judge = TopicJudge(node.plan.board)
        self._judge = Judge(node.plan.board, node.plan.statistics_path)
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.every(EVERY_S, self._publish)

    def _publish(self) -> None:
        message = DiagnosticArray()
        message.header.stamp = self._clock.now().to_msg()
        now = monotonic_ns()
        statuses = [
            *self._judge.judge(now),
            *self._topic_judge.judge(self._topics.counts, now),
            *self._of_node(),
        ]
        message.status = [self._written(each) for each in statuses]
        self._publisher.publish(message)

    def _of_node(self) -> list[Status]:
        """Return what is wrong with the node's names, logged when it begins."""
        namesakes = self._node.namesakes
        if namesakes and not self._has_namesakes:
            self._node.get_logger().warning(namesakes)
        self._has_namesakes = namesakes != ""
        name = f"{self._node.plan.board}: node"
        return [Status(name, Level.WARN, namesakes)] if namesakes else []

    def _written(self, status: Status) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([status.level]),
            name=status.name,
            message=status.message,
            hardware_id=self._node.plan.board,
            values=[KeyValue(key=key, value=text) for key, text in status.values.items()],
        )
