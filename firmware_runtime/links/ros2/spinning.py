"""Spinning of a node, so that no message ends it."""

from threading import Thread
from typing import Final

import rclpy
from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

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


class SpunNode:
    """A node in a context of its own, whose messages are handled in a thread from `begin` on."""

    def __init__(self, name: str, namespace: str) -> None:
        self._context = Context()
        rclpy.init(args=[], context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = Node(
            name,
            namespace=namespace,
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._goes_on = True
        self._thread = Thread(target=self._spin, name=name, daemon=True)

    def begin(self) -> None:
        """Start the thread."""
        self._thread.start()

    def close(self) -> None:
        """Wait until the thread has ended, and leave the graph."""
        self._goes_on = False
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def _spin(self) -> None:
        while self._goes_on:
            spin_once(self._executor, self.node, _TURN_S)
