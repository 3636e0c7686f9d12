"""A second vendor's DDS as referee: types, QoS, bytes, order, and that nothing is lost.

Run, node and referee are three processes; the referee is this one, without rclpy.
"""

import json
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from select import select
from statistics import median
from typing import Any

import numpy as np
import pytest

from firmware_runtime.board.ros.topic_table import table_of
from firmware_runtime.board.ros.topics import topics
from firmware_runtime.board.settings import RosSettings
from tests.support.bridged_run import line
from tests.support.referee import Referee, bytes_of, made, part, read, take_all, type_hash
from tests.support.ros_processes import FREE, RosProcesses
from tests.support.ros_user import RosUser
from tests.support.topics_run import EchoRobot
from tests.support.waiting import PATIENCE_S, wait_until

MANY = int(os.environ.get("FIRMWARE_RUNTIME_ROS_MESSAGES", "2000"))
AHEAD = 5
"""How many values are under way at a time: a socket of Unix holds ten."""
FLOAT = "std_msgs/msg/Float64"
ARRAY = "std_msgs/msg/Float64MultiArray"
TWIST = "geometry_msgs/msg/Twist"
STAMPED = "geometry_msgs/msg/TwistStamped"


class Parrot:
    """The run that answers and its node, as processes of their own."""

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        self.path = directory / "parrot.stats"
        self._stack = stack
        self.run = self.start("tests.support.topics_run", str(self.path))
        found = topics(EchoRobot(), RosSettings(rate_hz=0.0))
        table = json.dumps(table_of(found))
        self.node = self.start("tests.support.topics_node", "parrot", str(self.path), table)

    def start(self, module: str, *words: str) -> "subprocess.Popen[str]":
        process = subprocess.Popen(
            [sys.executable, "-m", module, *words], stdout=subprocess.PIPE, text=True
        )
        self._stack.callback(_end, process)
        return process

    def counts(self) -> dict[str, int]:
        """What the node counted, once it has ended."""
        self.node.send_signal(signal.SIGTERM)
        out, _ = self.node.communicate(timeout=PATIENCE_S)
        counts: dict[str, int] = json.loads(out)
        return counts


@pytest.fixture
def referee(robot: RosProcesses) -> Referee:  # noqa: ARG001 -- has set the domain
    return Referee()


@pytest.fixture
def parrot(tmp_path: Path, referee: Referee) -> Iterator[Parrot]:
    with ExitStack() as stack:
        parrot = Parrot(tmp_path, stack)
        wait_until(lambda: len(_of_parrot(referee)) >= 4, "its topics are announced")
        yield parrot


def _of_parrot(referee: Referee) -> list[str]:
    return [topic for topic in referee.published() if topic.startswith("/parrot/")]


def _end(process: "subprocess.Popen[str]") -> None:
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


class Conversation:
    """A topic that is commanded and the one that answers, after a first answer came."""

    def __init__(self, referee: Referee, say: tuple[str, str], receive: tuple[str, str]) -> None:
        self.writer = referee.writer(*say)
        self.reader = referee.reader(*receive)
        self._say, self._receive = say[1], receive[1]
        self.received: list[Any] = []

    def until_answered(self, **fields: Any) -> None:  # noqa: ANN401 -- of any type
        """Repeat a message until it is answered: to be matched is announced too early."""

        def answered() -> bool:
            self.say(**fields)
            return bool(self.receive())

        wait_until(answered, "the first answer")
        self.quieten()

    def quieten(self) -> None:
        """Take what is still under way."""
        last = -1
        while last != len(self.received):
            last = len(self.received)
            wait_until(_counted(20), "some looks")
            self.receive()

    def say(self, **fields: Any) -> None:  # noqa: ANN401
        self.writer.write(made(self._say, **fields))

    def receive(self) -> list[Any]:
        """What has come; bytes that are not what rosbags makes of them fail."""
        for cdr in take_all(self.reader):
            message = read(self._receive, cdr)
            assert bytes_of(self._receive, message) == cdr
            self.received.append(message)
        return self.received


def _counted(looks: int) -> Any:  # noqa: ANN401 -- a function for wait_until
    left = iter(range(looks))
    return lambda: next(left, None) is None


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:  # noqa: ANN401
    return part("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def header(sec: int) -> Any:  # noqa: ANN401
    stamp = part("builtin_interfaces/msg/Time", sec=sec, nanosec=0)
    return part("std_msgs/msg/Header", stamp=stamp, frame_id="")


@pytest.mark.slow
def test_messages_each_way_are_neither_lost_nor_out_of_order(
    parrot: Parrot, referee: Referee
) -> None:
    talk = Conversation(referee, ("/parrot/say", FLOAT), ("/parrot/echo/said", FLOAT))
    talk.until_answered(data=-1.0)
    talk.received.clear()
    said = 0

    def all_received() -> bool:
        nonlocal said
        while said < MANY and said - len(talk.received) < AHEAD:
            talk.say(data=float(said))
            said += 1
        return len(talk.receive()) >= MANY

    wait_until(all_received, "the last answer", lambda: f"{len(talk.received)} of {said} answered")
    assert [message.data for message in talk.received] == [float(each) for each in range(MANY)]
    counts = parrot.counts()
    assert counts["taken"] >= MANY
    assert {"dropped", "refused", "failed"}.isdisjoint(counts)


@pytest.mark.usefixtures("parrot")
def test_types_hashes_and_qos_are_those_of_ros(referee: Referee) -> None:
    published = {
        topic: (each.type, each.is_reliable, each.is_volatile)
        for topic, each in referee.published().items()
        if topic.startswith("/parrot/")
    }
    assert published == {
        "/parrot/echo/said": (FLOAT, True, True),
        "/parrot/echo/drives": (TWIST, True, True),
        "/parrot/echo/places": (ARRAY, True, True),
        "/parrot/echo/count": ("std_msgs/msg/Int64", True, True),
    }
    expected = {
        ("/parrot/say", FLOAT, True),
        ("/parrot/place", ARRAY, False),
        ("/parrot/cmd_vel", TWIST, True),
        ("/parrot/cmd_vel", STAMPED, True),
    }

    def taken() -> set[tuple[str, str, bool]]:
        return {(each.topic, each.type, each.is_reliable) for each in referee.taken()}

    wait_until(lambda: taken() >= expected, "what it takes is announced")
    for each in (*referee.published().values(), *referee.taken()):
        if each.topic.startswith("/parrot/"):
            assert each.type_hash == type_hash(each.type), each


def test_cmd_vel_is_taken_as_twist_and_as_twist_stamped(parrot: Parrot, referee: Referee) -> None:
    answer = ("/parrot/echo/drives", TWIST)
    twist = Conversation(referee, ("/parrot/cmd_vel", TWIST), answer)
    twist.until_answered(linear=vector(x=0.5), angular=vector(z=-1.0))
    assert (twist.received[-1].linear.x, twist.received[-1].angular.z) == (0.5, -1.0)

    stamped = Conversation(referee, ("/parrot/cmd_vel", STAMPED), answer)
    body = part(TWIST, linear=vector(x=0.25), angular=vector())
    stamped.until_answered(header=header(0), twist=body)
    assert stamped.received[-1].linear.x == 0.25
    stamped.say(header=header(5), twist=body)
    twist.say(linear=vector(y=1.0), angular=vector())
    twist.say(linear=vector(x=math.nan), angular=vector())
    twist.quieten()
    twist.received.clear()
    twist.until_answered(linear=vector(x=0.125), angular=vector())
    assert {each.linear.x for each in twist.received} == {0.125}
    wait_until(_counted(50), "what is under way has come")
    assert parrot.counts()["refused"] == 3


def test_a_measured_place_is_taken_by_best_effort(parrot: Parrot, referee: Referee) -> None:

    layout = part("std_msgs/msg/MultiArrayLayout", dim=[], data_offset=0)
    place = Conversation(referee, ("/parrot/place", ARRAY), ("/parrot/echo/places", ARRAY))
    place.until_answered(layout=layout, data=np.array([1.0, -2.0]))
    assert list(place.received[-1].data) == [1.0, -2.0]
    assert place.received[-1].layout.dim[0].label == "position,rate"
    assert "failed" not in parrot.counts()


def test_an_imu_of_tachobot_is_what_every_program_of_ros_reads(
    robot: RosProcesses, referee: Referee
) -> None:
    kind = "sensor_msgs/msg/Imu"
    robot.run()
    robot.node("--autostart")
    reader = referee.reader("/tachobot/imu/data_raw", kind)
    came: list[bytes] = []

    def has_enough() -> bool:
        came.extend(take_all(reader))
        return len(came) > 30

    wait_until(has_enough, "samples")
    messages = [read(kind, cdr) for cdr in came]
    assert [bytes_of(kind, each) for each in messages] == came
    stamps = [each.header.stamp.sec * 10**9 + each.header.stamp.nanosec for each in messages]
    assert stamps == sorted(stamps)
    # half of its 100 Hz; where a run on a busy machine pauses, the newest that was left out follows
    assert median(later - sooner for sooner, later in pairwise(stamps)) > 15_000_000
    assert {each.header.frame_id for each in messages} == {"imu_link"}
    assert {each.orientation_covariance[0] for each in messages} == {-1.0}
    assert messages[-1].linear_acceleration.z == pytest.approx(9.8, abs=0.5)


def test_a_reference_is_taken_while_the_node_is_active(
    robot: RosProcesses, user: RosUser, referee: Referee
) -> None:
    robot.run(*FREE)
    node = robot.node("--lease", "20")
    wait_until(lambda: user.change("/tachobot/tachobot", "configure"), "its run is there")
    reference = referee.writer("/tachobot/yaw_reference", FLOAT)

    def is_said() -> bool:
        reference.write(made(FLOAT, data=0.5))
        assert node.stdout is not None
        return bool(select([node.stdout], [], [], 0.05)[0])

    wait_until(is_said, "the node says that it is not active")
    line(node, "not taken while the node is not active")
    wait_until(lambda: user.change("/tachobot/tachobot", "activate"), "the node is active")
    forces = referee.reader("/tachobot/controller/forces", ARRAY)
    received: list[float] = []

    def turns() -> bool:
        reference.write(made(FLOAT, data=0.5))
        received.extend(read(ARRAY, cdr).data[0] for cdr in take_all(forces))
        return any(abs(each) > 0.01 for each in received)

    wait_until(turns, "the platform turns")
