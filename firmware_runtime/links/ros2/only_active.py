"""One active node of a name: two that find each other have armed two robots by one set of names.

Such a pair can come about while neither knows of the other yet, as where two networks are joined.
What is said to one robot is said to both then, so each of the two disarms its own. An active node
is known by a publisher that it has only while it is active, on a topic that is hidden and on which
nothing is ever said; a node that is merely there disarms no other.

The first of the two to find the other keeps its publisher for a while after it is inactive, so that
the other, which may learn of it later, disarms too.
"""

from time import monotonic_ns
from typing import Any, Final

from std_msgs.msg import Empty

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.ros2.node import Part, RobotNode

MARK: Final = "_active"
KEPT: Final = 10 * SECOND
"""Ns for which a node that has found another is still seen as one that was active: some times as
long as it takes participants of DDS to find each other."""


class OnlyActive(Part):
    """Deactivates its node where another one of the name is active, too."""

    def __init__(self, node: RobotNode) -> None:
        self._node = node
        self._mark: Any = None
        self._keep_until = 0

    def activate(self) -> None:
        """Let others know."""
        if self._mark is None:
            self._mark = self._node.create_publisher(Empty, MARK, 1)

    def deactivate(self) -> None:
        """Be no active node any more."""
        if self._mark is not None and monotonic_ns() >= self._keep_until:
            self._node.destroy_publisher(self._mark)
            self._mark = None

    def clean_up(self) -> None:
        """Remove what others know the node by."""
        self._keep_until = 0
        self.deactivate()

    def follow(self, revision: int) -> None:  # noqa: ARG002 -- of the run's settings
        """Look for another one."""
        if self._node.phase != "active":
            self.deactivate()
        elif self._node.count_publishers(self._mark.topic_name) > 1:
            self._keep_until = monotonic_ns() + KEPT
            self._node.get_logger().error(
                f"another active node of this domain has {self._mark.topic_name} too, so what is "
                "said to one robot is said to both: each of the two disarms its own; expected "
                "robots of different names, or --ros-args -r __ns:=/OTHER"
            )
            self._node.trigger_deactivate()
