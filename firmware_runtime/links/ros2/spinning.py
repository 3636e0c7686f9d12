"""One turn of an executor that no message ends."""

from rclpy.executors import Executor
from rclpy.node import Node


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
