"""The carrier of a link over ROS 2 with the instant of each frame at each point noted.

In the interpreter of the ROS environment; $STAMPS is the file that is written at the end.
"""

import json
import os
import socket
import sys
from pathlib import Path
from time import monotonic_ns
from typing import Any

from firmware_runtime.links.cut.udp import UdpAddress, begin_carrier
from firmware_runtime.links.ros2 import carrier
from firmware_runtime.links.ros2.carrier import TopicSocket

_NOTES: list[tuple[str, int, int, int]] = []


def _note(point: str, frame: bytes) -> None:
    """A frame by session and counter, as its header has them."""
    at = monotonic_ns()
    _NOTES.append((point, int.from_bytes(frame[8:16]), int.from_bytes(frame[24:32]), at))


class StampedTopics(TopicSocket):
    """Notes when a frame is published, and when it has come."""

    def sendto(self, frame: bytes, address: UdpAddress) -> None:
        """Publish a frame."""
        _note("published", frame)
        super().sendto(frame, address)

    def receive(self, message: Any) -> None:  # noqa: ANN401 -- ROS has no types
        """Take a message."""
        _note("arrived", message.data.tobytes())
        super().receive(message)


class StampedRun:
    """The run's end of the pair; notes when a frame is read, and when it is handed on."""

    def __init__(self, pair: socket.socket) -> None:
        self._pair = pair

    def fileno(self) -> int:
        """The pair's."""
        return self._pair.fileno()

    def recv(self, most: int) -> bytes:
        """Read a frame."""
        frame = self._pair.recv(most)
        _note("read", frame)
        return frame

    def send(self, frame: bytes) -> int:
        """Hand a frame on."""
        _note("handed", frame)
        return self._pair.send(frame)


def main() -> int:
    """Carry, then write what was noted."""
    setattr(carrier, "TopicSocket", StampedTopics)  # noqa: B010 -- a class in a class's place
    setattr(carrier, "begin_carrier", lambda pair: StampedRun(begin_carrier(pair)))  # noqa: B010
    status = carrier.main()
    Path(os.environ["STAMPS"]).write_text(json.dumps(_NOTES))
    return status


if __name__ == "__main__":
    sys.exit(main())
