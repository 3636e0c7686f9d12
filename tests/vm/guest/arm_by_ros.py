"""Calls the service `arm` of TachoBot's node once; in the interpreter of the ROS environment."""

import sys
from typing import Final

import rclpy
from std_srvs.srv import Trigger

PATIENCE_S: Final = 60.0


def main() -> int:
    """Return 0 where the robot is armed; print why not."""
    rclpy.init(args=[])
    node = rclpy.create_node("arm_by_ros")
    client = node.create_client(Trigger, "/tachobot/arm")
    if not client.wait_for_service(PATIENCE_S):
        sys.stdout.write("no service /tachobot/arm\n")
        return 1
    answer = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, answer, timeout_sec=PATIENCE_S)
    response = answer.result() if answer.done() else None
    sys.stdout.write("no answer\n" if response is None else f"{response.message}\n")
    return 0 if response is not None and response.success else 1


if __name__ == "__main__":
    sys.exit(main())
