"""rclpy to rclpy and back without runs and carriers: what the others are compared with.

python -m benchmarks.ros2.bare pong
python -m benchmarks.ros2.bare ping COUNT INTERVAL_S     prints the round trips, ns, as JSON
"""

import json
import sys
from select import select
from threading import Event
from time import monotonic_ns
from typing import Any

from firmware_runtime.links.ros2.carrier import CarrierNode, TopicSocket

SIZE = 128
PATIENCE_S = 1.0


class Pong(TopicSocket):
    """Publishes what arrives, at once."""

    def receive(self, message: Any) -> None:  # noqa: ANN401 -- ROS has no types
        """Answer."""
        self.sendto(message.data.tobytes(), ("", 0))


class Ping(TopicSocket):
    """Notes when an answer has come."""

    came = Event()
    at = 0

    def receive(self, message: Any) -> None:  # noqa: ANN401, ARG002
        """Note the instant."""
        self.at = monotonic_ns()
        self.came.set()


def main(role: str, count: int = 0, interval_s: float = 0.0) -> None:
    """Answer until standard input ends, or ask so often and print how long it took."""
    spinning = CarrierNode(f"bare_{role}", "/bare")
    if role == "pong":
        Pong(spinning.node, "back", "out")
        spinning.begin()
        sys.stdin.read()
        spinning.close()
        return
    ping = Ping(spinning.node, "out", "back")
    spinning.begin()
    trips: list[int] = []
    while len(trips) < count:
        ping.came.clear()
        began = monotonic_ns()
        ping.sendto(bytes(SIZE), ("", 0))
        if ping.came.wait(PATIENCE_S):
            trips.append(ping.at - began)
        select((), (), (), interval_s)
    sys.stdout.write(json.dumps(trips) + "\n")
    spinning.close()


if __name__ == "__main__":
    main(sys.argv[1], *(int(each) for each in sys.argv[2:3]), *(float(x) for x in sys.argv[3:4]))
