"""The robot's topics as a part of its node: publishers, and subscriptions that let values in.

QoS by REP-2003: publishers are reliable, keep last 10, volatile, which every subscriber can match;
values for the robot are taken reliably, too, what a sensor measures by best effort.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from time import monotonic_ns, time_ns
from typing import Final

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from firmware_runtime.board.ros.conventions import Fields
from firmware_runtime.board.ros.topics import Publication, Subscription, Topics
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.links.ros2.messages import message_class, message_of, stamp, stamp_of
from firmware_runtime.links.ros2.node import Part
from firmware_runtime.links.ros2.ports_end import Pace, PortsEnd, SaidOnce
from firmware_runtime.links.ros2.spinning import SpunNode

OLDEST: Final = 500 * MILLISECOND
"""A command whose header is older is refused, ns, or so far in the future; without a time it has no
age."""
RELIABLE: Final = QoSProfile(depth=10)
SENSOR: Final = QoSProfile(
    depth=5, reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE
)


class _Out:
    """One topic that is published; `pace` keeps the instant and the fields of a message."""

    def __init__(self, node: Node, publication: Publication) -> None:
        message = publication.message
        self.publication = publication
        self.pace: Pace[tuple[int, Fields]] = Pace(publication.rate_hz)
        self.publisher = node.create_publisher(
            message_class(message.type), publication.topic, RELIABLE
        )

    def publish(self, at: int, fields: Fields) -> None:
        """Publish a message of the instant `at`, in ns since 1970."""
        message = message_of(self.publication.message.type, fields)
        if self.publication.message.is_stamped:
            stamp(message, at, self.publication.frame)
        self.publisher.publish(message)


class RobotTopics(Part):
    """Publishes from `configure` on, as long as there is a run; takes values while active.

    `holds_robot` says whether it is certain at the moment that the node has the robot armed.
    """

    def __init__(
        self,
        node: Node,
        topics: Topics,
        ports: Path,
        holds_robot: Callable[[], bool] = lambda: True,
    ) -> None:
        self._own: Counter[str] = Counter()
        """Messages published, taken, not taken since the node was inactive, and failed."""
        self._of_runs: Counter[str] = Counter()
        self._node = node
        self._topics = topics
        self._ports = ports
        self._holds_robot = holds_robot
        self._outs: dict[str, list[_Out]] = {}
        self._beside: list[SpunNode] = []
        """Participants beside this one, which alone cannot take two types of message on a topic."""
        self._subscriptions: list[tuple[Node, object]] = []
        self._run: PortsEnd | None = None
        self._is_active = False
        self._log_once = SaidOnce(self._log)
        for port, why in topics.without.items():
            node.get_logger().debug(f"{port}: no topic; {why}")

    # A part of the node ---------------------------------------------------------------------------

    def configure(self) -> None:
        """Make publishers and subscribers, and begin to watch the run."""
        for each in self._topics.publications:
            self._outs.setdefault(each.port, []).append(_Out(self._node, each))
        self._run = PortsEnd(self._ports, list(self._outs), self._arrived, self._log)
        for number, subscription in self._numbered():
            self._subscribe(self._node_for(number), subscription)
        self._run.begin(self._publish_late)

    def activate(self) -> None:
        """Take values from now on."""
        self._is_active = True

    def deactivate(self) -> None:
        """Take no value any more."""
        self._is_active = False

    def clean_up(self) -> None:
        """Remove publishers and subscribers."""
        self._is_active = False
        if self._run is not None:
            self._run.close()
            self._of_runs += self._run.counts
            self._run = None
        for node, subscription in self._subscriptions:
            node.destroy_subscription(subscription)
        for out in (each for some in self._outs.values() for each in some):
            self._node.destroy_publisher(out.publisher)
        for beside in self._beside:
            beside.close()
        self._subscriptions, self._outs, self._beside = [], {}, []

    @property
    def counts(self) -> Counter[str]:
        """Counters of messages, and of values that were sent to runs and came from them."""
        run = Counter() if self._run is None else self._run.counts
        # copied at once: the thread that reads the run counts meanwhile
        return Counter(self._own) + self._of_runs + Counter(run)

    # From the run ---------------------------------------------------------------------------------

    def _arrived(self, port: str, t_ns: int, value: object) -> None:
        now = monotonic_ns()
        for out in self._outs.get(port, ()):
            each = out.publication
            try:
                fields = each.message.fields(value, each.options)
            except Exception as error:  # noqa: BLE001 -- of a package's own convention
                self._failed(f"{each.topic}: {type(error).__name__}: {error}")
                continue
            if fields is not None and out.pace.take((t_ns, fields), t_ns, now) is not None:
                self._publish(out, t_ns, fields)

    def _publish_late(self, now: int) -> int:
        """Publish what was kept and is due now; return when something is due again."""
        outs = [each for some in self._outs.values() for each in some]
        for out in outs:
            if (kept := out.pace.late(now)) is not None:
                self._publish(out, *kept)
        return min((each.pace.due_at for each in outs), default=NEVER)

    def _publish(self, out: _Out, t_ns: int, fields: Fields) -> None:
        if self._run is None:
            return
        topic = out.publication.topic
        try:
            out.publish(self._run.stamps.of(topic, t_ns), fields)
        except Exception as error:  # noqa: BLE001 -- a field that its message does not have
            self._failed(f"{topic}: {type(error).__name__}: {error}")
        else:
            self._own["published"] += 1

    # To the run -----------------------------------------------------------------------------------

    def _numbered(self) -> Iterator[tuple[int, Subscription]]:
        """Each subscription, and how many others of its topic came before it."""
        seen: Counter[str] = Counter()
        for each in self._topics.subscriptions:
            yield seen[each.topic], each
            seen[each.topic] += 1

    def _node_for(self, number: int) -> Node:
        while len(self._beside) < number:
            name = f"{self._node.get_name()}_type_{len(self._beside) + 2}"
            self._beside.append(SpunNode(name, self._node.get_namespace()))
            self._beside[-1].begin()
        return self._beside[number - 1].node if number > 0 else self._node

    def _subscribe(self, node: Node, each: Subscription) -> None:
        is_beside = node is not self._node  # its context has no remapping of its own
        made = node.create_subscription(
            message_class(each.message.type),
            self._node.resolve_topic_name(each.topic) if is_beside else each.topic,
            partial(self._take, each),
            SENSOR if each.message.is_sensor else RELIABLE,
        )
        self._subscriptions.append((node, made))

    def _take(self, each: Subscription, message: object) -> None:
        run = self._run
        if run is None or not self._is_active:
            self._own["inactive"] += 1
            self._log_once(f"{each.topic}: not taken while the node is not active")
            return
        if not self._holds_robot():
            why = "came while it was not known whether the lease holds, or after a standstill"
            run.refuse(f"{each.topic}: {why}")
            return
        try:
            if each.message.is_stamped:
                check_age(stamp_of(message))
            value = each.message.value(message, each.options)
            _check_finite(value)
        except Exception as error:  # noqa: BLE001 -- of a package's own convention
            run.refuse(f"{each.topic}: {error}")
        else:
            self._own["taken"] += 1
            run.send(each.port, value)

    # ----------------------------------------------------------------------------------------------

    def _failed(self, sentence: str) -> None:
        self._own["failed"] += 1
        self._log_once(f"{sentence}; not published")

    def _log(self, sentence: str) -> None:
        self._node.get_logger().warning(sentence)


def check_age(stamped: int) -> None:
    """Raises ValueError for a command that is too old, or of a future that hides its age."""
    age = time_ns() - stamped
    if stamped > 0 and age > OLDEST:
        raise ValueError(f"older than {OLDEST / 1e9:g} s by its header; expected a new one")
    if age < -OLDEST:
        raise ValueError(
            f"more than {OLDEST / 1e9:g} s in the future by its header; expected clocks that agree"
        )


def _check_finite(value: object) -> None:
    """Raises ValueError for a number that JSON has no word for."""
    if isinstance(value, dict):
        for each in value.values():
            _check_finite(each)
    elif isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value}, expected finite numbers")
