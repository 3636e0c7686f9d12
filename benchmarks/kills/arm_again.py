"""Asks a robot's node to arm it, again and again, as often as that is wanted: `FILE`.

In the interpreter of the ROS environment. The file holds an instant; one that is new is a wish, for
which the service `arm` is called until it succeeds. Ends with its standard input.
"""

import sys
from pathlib import Path
from select import select
from typing import Final

import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

ANSWER_S: Final = 0.2
"""How long to wait for an answer: the node that was asked may have been killed."""
LOOK_S: Final = 0.02


def main(wishes: Path) -> None:
    """Ask until standard input ends."""
    rclpy.init(args=[])
    node = rclpy.create_node("arm_again")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    client = node.create_client(Trigger, "/tachobot/arm")
    done = ""
    while not select([sys.stdin], (), (), LOOK_S)[0]:
        wish = wishes.read_text() if wishes.exists() else ""
        if wish not in {"", done} and client.service_is_ready():
            answer = client.call_async(Trigger.Request())
            executor.spin_until_future_complete(answer, ANSWER_S)
            if answer.done() and answer.result().success:
                done = wish


if __name__ == "__main__":
    main(Path(sys.argv[1]))
