"""The carrier of a link over ROS 2: as the one over UDP, with two topics in the network's place.

    run <--pair of Unix sockets--> this process <--topics--> the other end's carrier <--pair--> run

The end with the hardware publishes on `/BOARD/link/from_robot` and listens to `to_robot`, the other
one the other way round: std_msgs/UInt8MultiArray, a frame in each; reliable, keep last 10. What is
signed, refused, counted and reported is as over UDP: the same code does it.
"""

import argparse
import socket
import sys
from array import array
from collections.abc import Callable
from contextlib import suppress
from threading import Lock
from typing import Any, Final, NoReturn

from rclpy.node import Node
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt8MultiArray

from firmware_runtime.links.cut.udp import Carrier, carry
from firmware_runtime.links.endpoint import UdpAddress
from firmware_runtime.links.ros2.spinning import SpunNode

_OTHER_END: Final[UdpAddress] = ("ros2", 0)


class TopicSocket:
    """Two topics in the place of a UDP socket: what `Carrier` asks of one.

    Frames do not wait in it: `on_frame` is called with each, in the executor's thread.
    """

    def __init__(self, node: Node, sends: str, receives: str) -> None:
        self.on_frame: Callable[[bytes], None] = lambda _: None
        self._woken, self._wake = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK
        )
        quality = QoSProfile(depth=10)
        self._publisher = node.create_publisher(UInt8MultiArray, sends, quality)
        node.create_subscription(UInt8MultiArray, receives, self.receive, quality)

    def fileno(self) -> int:
        """The descriptor that becomes readable when the carrier is to look after itself."""
        return self._woken.fileno()

    def wake(self) -> None:
        """Make it readable."""
        with suppress(BlockingIOError):  # it is, already
            self._wake.send(b".")

    def sendto(self, frame: bytes, _address: UdpAddress) -> None:
        """Publish a frame."""
        self._publisher.publish(UInt8MultiArray(data=array("B", frame)))

    def recvfrom(self, most: int) -> NoReturn:
        """No frame waits here. Raises BlockingIOError."""
        while True:
            self._woken.recv(most)

    def receive(self, message: Any) -> None:  # noqa: ANN401 -- ROS has no types
        """Hand a message on, as the bytes that it bears."""
        self.on_frame(message.data.tobytes())


class TopicCarrier(Carrier):
    """Carries between a run and topics: in from the executor's thread, out from the other."""

    def __init__(self, run: socket.socket, key: bytes | None, stated: argparse.Namespace) -> None:
        self._carried_by = SpunNode(f"link_{stated.role}", stated.namespace)
        self._topics = TopicSocket(self._carried_by.node, stated.sends, stated.receives)
        in_place: Any = self._topics
        super().__init__(run, in_place, key, _OTHER_END)
        self._lock = Lock()
        self._topics.on_frame = self._arrive
        self._carried_by.begin()

    def part(self) -> None:
        """Say a bye in the run's place, where it has said none, and leave the graph."""
        super().part()
        self._carried_by.close()

    def _arrive(self, frame: bytes) -> None:
        with self._lock:
            self.take(frame, _OTHER_END)
            has_news = self._has_news
        if has_news:
            self._topics.wake()

    def _send(self, plain: bytes) -> None:
        with self._lock:
            super()._send(plain)

    def _report(self) -> None:
        with self._lock:
            super()._report()


def main() -> int:
    """Carry over topics."""
    parser = argparse.ArgumentParser()
    for option in ("--namespace", "--role", "--sends", "--receives"):
        parser.add_argument(option, required=True)
    return carry(parser, TopicCarrier)


if __name__ == "__main__":
    sys.exit(main())
