"""A real carrier and a real run, without a controller: nothing that is sent drives a motor."""

import json
import signal
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from random import Random
from select import select
from typing import Any

import pytest

from firmware_runtime.board.assignments import set_words
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.links.key_file import write_key
from firmware_runtime.statistics.figures import LinkFigures
from firmware_runtime.statistics.reader import read_statistics
from tests.support.bridged_run import Processes
from tests.support.linked_runs import free_port
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
BURST = 24
"""So few fit into the socket of a carrier that has no processor at the moment."""
ENOUGH = 60


class Relay:
    """Between a controller and a robot's carrier; keeps what passes by, each way."""

    def __init__(self, robot: tuple[str, int], stack: ExitStack) -> None:
        self.recorded: list[bytes] = []
        self._robot = robot
        self._front, self._back = (
            stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)
        )
        self._front.bind(("127.0.0.1", 0))
        self._back.bind(("127.0.0.1", 0))
        self.where: tuple[str, int] = self._front.getsockname()
        self._is_over = threading.Event()
        thread = threading.Thread(target=self._carry)
        thread.start()
        stack.callback(thread.join)
        stack.callback(self._is_over.set)

    def _carry(self) -> None:
        controller = None
        while not self._is_over.is_set():
            for ready in select([self._front, self._back], [], [], 0.05)[0]:
                datagram, sender = ready.recvfrom(16384)
                self.recorded.append(datagram)
                if ready is self._front:
                    controller = sender
                    self._back.sendto(datagram, self._robot)
                elif controller is not None:
                    self._front.sendto(datagram, controller)


class Robot(Processes):
    """The robot's end on served doubles, which keep a log of every output."""

    out = None

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        super().__init__(directory, stack)
        self.log = directory / "doubles.log"
        self.key = directory / "link.key"
        write_key(self.key)
        self.where = ("127.0.0.1", free_port())
        doubles = directory / "doubles.socket"
        self.start("doubles", "serve", "tachobot", "--socket", doubles, "--log", self.log)
        wait_until(doubles.exists, "the doubles are served")
        settings = ("arming.demand_guard=false", "arming.max_late_percent=100")
        self._words = [
            "--doubles",
            doubles,
            *set_words(settings),
        ]

    def run(self) -> "subprocess.Popen[bytes]":
        link = f"udp:{self.where[0]}:{self.where[1]},key={self.key}"
        options = ["--role", "robot", "--link", link, "--supervised", "--arm", "--for", 600]
        return self.start("run", "tachobot", *self._words, *options)

    def controller(self, where: tuple[str, int]) -> "subprocess.Popen[bytes]":
        link = f"udp:{where[0]}:{where[1]},key={self.key}"
        return self.start("run", "tachobot", "--role", "controller", "--link", link)

    def logged(self) -> list[dict[str, Any]]:
        """The log of the doubles as far as it is written, in whole lines."""
        whole, _, _ = self.log.read_text().rpartition("\n")
        return [json.loads(line) for line in whole.splitlines()]

    def driven(self) -> list[dict[str, Any]]:
        """Every time an output went on."""
        return [line for line in self.logged() if line.get("value", 0.0) != 0.0]

    def is_left(self) -> bool:
        """Whether the doubles have answered all that a run which has ended had asked."""
        return any(line.get("event") == "gone" for line in self.logged())

    def link(self, process: "subprocess.Popen[bytes]") -> LinkFigures | None:
        """What this run's end of the link has counted, once there is something."""
        try:
            found = read_statistics(self.directory / "tachobot.stats")
        except StatisticsFileError:
            return None
        return found.figures().link if found.header.writer.pid == process.pid else None


@contextmanager
def robot_in(directory: Path) -> Iterator[tuple[Robot, ExitStack]]:
    with ExitStack() as stack:
        yield Robot(directory, stack), stack


def recording(robot: Robot, stack: ExitStack) -> list[bytes]:
    """What both ends said to each other first, and what they said while the robot was driven."""
    relay = Relay(robot.where, stack)
    run, controller = robot.run(), robot.controller(relay.where)
    wait_until(lambda: robot.driven() != [], "it drives")
    wait_until(lambda: len(relay.recorded) > 2 * ENOUGH, "some more was said")
    for process in (controller, run):
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_until(robot.is_left, "its last command is carried out")
    return [*relay.recorded[:ENOUGH], *relay.recorded[-ENOUGH:]]


def broken(datagrams: list[bytes], random: Random) -> list[bytes]:
    """Each with one bit flipped, cut, made longer, or with another tag; and noise."""
    flipped = []
    for datagram in datagrams:
        bit = random.randrange(8 * len(datagram))
        other = bytearray(datagram)
        other[bit // 8] ^= 1 << bit % 8
        flipped.append(bytes(other))
    cut = [datagram[: random.randrange(len(datagram))] for datagram in datagrams]
    longer = [datagram + b"\0" for datagram in datagrams]
    forged = [datagram[:-32] + random.randbytes(32) for datagram in datagrams]
    plain = [datagram[:-32] for datagram in datagrams]
    noise = [random.randbytes(random.randrange(300)) for _ in datagrams]
    return [*flipped, *cut, *longer, *forged, *plain, *noise]


def greets_anyone(datagram: bytes) -> bool:
    """Whether it is a hello to an end that it does not know: neither taken nor refused."""
    return datagram[4] == 1 and datagram[16:24] == bytes(8)


def test_what_was_recorded_or_is_forged_never_drives_a_motor(tmp_path: Path) -> None:
    with robot_in(tmp_path) as (robot, stack):
        said = recording(robot, stack)
        hostile = [each for each in said if not greets_anyone(each)]
        random = Random(1)  # noqa: S311 -- to be repeated
        hostile += broken(said, random)
        random.shuffle(hostile)
        driven_before = len(robot.driven())
        run = robot.run()
        wait_until(lambda: robot.link(run) is not None, "the run has begun")
        refused = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attacker:
            bursts = [hostile[at : at + BURST] for at in range(0, len(hostile), BURST)]
            for burst in [*bursts, *([datagram + bytes(61_440)] for datagram in said[:BURST])]:
                for datagram in burst:
                    attacker.sendto(datagram, robot.where)
                refused += len(burst)
                wait_until(lambda: refused_by(robot, run) >= refused, "all are refused")  # noqa: B023
        found = robot.link(run)
        assert found is not None
        assert sum(found.refused.values()) == refused
        assert (found.received, found.is_good) == (0, False)
        assert min(found.refused[reason] for reason in ("forged", "oversized", "wrong_session")) > 0
        assert robot.driven()[driven_before:] == []
        run.send_signal(signal.SIGTERM)
        assert run.wait(PATIENCE_S) == 143


def refused_by(robot: Robot, run: "subprocess.Popen[bytes]") -> int:
    found = robot.link(run)
    return 0 if found is None else sum(found.refused.values())
