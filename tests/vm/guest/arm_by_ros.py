"""Calls the service `arm` of TachoBot's node until it is armed; in the ROS environment.

Starting takes long where the guest is emulated, so one process asks again and again.
"""

import sys
from time import monotonic
from typing import Final

import rclpy
from std_srvs.srv import Trigger

PATIENCE_S: Final = 120.0
ANSWER_S: Final = 20.0


def main() -> int:
    """Return 0 where the robot is armed; print why not."""
    rclpy.init(args=[])
    node = rclpy.create_node("arm_by_ros")
    client = node.create_client(Trigger, "/tachobot/arm")
    if not client.wait_for_service(PATIENCE_S):
        sys.stdout.write("no service /tachobot/arm\n")
        return 1
    give_up_at, said = monotonic() + PATIENCE_S, "no answer"
    while monotonic() < give_up_at:
        answer = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, answer, timeout_sec=ANSWER_S)
        if answer.done():
            said = answer.result().message
            if answer.result().success:
                return 0
    sys.stdout.write(f"{said}\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())
