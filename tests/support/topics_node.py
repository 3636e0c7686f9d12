"""A bare node with the topics of a robot, active from the beginning; ends at SIGTERM.

python -m tests.support.topics_node NAME PATH TOPICS
"""

import json
import signal
import sys
from pathlib import Path

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from firmware_runtime.board.ros.conventions import conventions
from firmware_runtime.board.ros.topic_table import topics_in
from firmware_runtime.links.ros2.topics import RobotTopics


def main(name: str, path: Path, table: str) -> None:
    """Carry until the signal, then say what was counted."""
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _frame: ended.append(number))
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    node = Node(name, namespace=f"/{name}")
    topics = RobotTopics(node, topics_in(json.loads(table), conventions()), path)
    topics.configure()
    topics.activate()
    executor = EventsExecutor()
    executor.add_node(node)
    while not ended:
        executor.spin_once(timeout_sec=0.1)
    sys.stdout.write(json.dumps(topics.counts) + "\n")
    topics.clean_up()
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), sys.argv[3])
