"""Spinning of a node, so that no message ends it."""

from threading import Thread
from typing import Final

from rclpy.executors import Executor
from rclpy.node import Node

_TURN_S: Final = 0.2
"""`spin` would not end with its context, nor when it is to; each turn takes no longer than this."""


def spin_once(executor: Executor, node: Node, wait_s: float) -> None:
    """Handle what comes within this time.

    What rclpy raises of a request or message that it cannot read would end its process or thread:
    it is logged, once a second at most.
    """
    try:
        executor.spin_once(timeout_sec=wait_s)
    except Exception as error:  # noqa: BLE001 -- of ROS, which has no one root of its errors
        fault = f"not handled: {type(error).__name__}: {error}"
        node.get_logger().error(fault, throttle_duration_sec=1.0)


class Spinning:
    """Handles what comes to a node in a thread of its own, from `begin` to `end`."""

    def __init__(self, executor: Executor, node: Node, name: str) -> None:
        executor.add_node(node)
        self._executor, self._node = executor, node
        self._goes_on = True
        self._thread = Thread(target=self._spin, name=name, daemon=True)

    def begin(self) -> None:
        """Start the thread."""
        self._thread.start()

    def end(self) -> None:
        """Wait until it has ended."""
        self._goes_on = False
        self._thread.join()

    def _spin(self) -> None:
        while self._goes_on:
            spin_once(self._executor, self._node, _TURN_S)
