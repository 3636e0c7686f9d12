"""Runs and their ROS 2 nodes as processes, in a domain of DDS that no other test uses."""

import os
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import cycle, islice
from pathlib import Path

from tests.support.bridged_run import Processes, line

ROOT = Path(__file__).parents[2]
PYTHON = os.environ.get("FIRMWARE_RUNTIME_TEST_PYTHON", str(ROOT / ".venv/bin/python"))
"""The interpreter of the runs; that of these tests has rclpy, and a run refuses it."""
ROS_VENV = Path(os.environ.get("FIRMWARE_RUNTIME_ROS_VENV", ROOT / ".venv-ros"))
_OF_ROS = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
DOMAINS = range(1, 101)
"""Above them the ports of DDS are among those that the kernel gives away."""
_in_turn = cycle(DOMAINS)


class RosProcesses(Processes):
    """Runs and nodes, outside of the tests' own environment."""

    command = (PYTHON, "-m", "firmware_runtime.cli")

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        super().__init__(directory, stack)
        self.statistics = directory / "tachobot.stats"

    @property
    def environment(self) -> dict[str, str]:
        variables = {**super().environment, "PYTHONUNBUFFERED": "1"}
        return {name: text for name, text in variables.items() if name not in _OF_ROS}

    def run(self, *words: str, board: str = "tachobot") -> "subprocess.Popen[bytes]":
        """A run on doubles, in real time, until it is stopped."""
        return self.start("run", board, "--doubles", "--for", "600", *words)

    def node(
        self, *words: str, board: str = "tachobot", under: Sequence[str] = ()
    ) -> "subprocess.Popen[bytes]":
        """A node that is up."""
        process = self.start("ros2", board, "--venv", str(ROS_VENV), *words, under=under)
        line(process, "is up")
        return process


@contextmanager
def domain() -> Iterator[int]:
    """A domain's number that no other test on this machine has until this is left.

    Nor had one of this process just before: rclpy's own publisher of a lifecycle node's transitions
    is announced until the node's cycles of references are collected, however it was destroyed.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
        for number in islice(_in_turn, len(DOMAINS)):
            try:
                claim.bind(f"\0firmware-runtime-test-domain-{number}")
            except OSError:
                continue
            yield number
            return
    raise AssertionError("no domain of DDS is free")


FREE = (
    "--supervised",
    "--set=arming.demand_guard=false",
    "--set=arming.max_late_percent=100",
    "--set=executive.fifo_priority=0",
)
"""A run that is armed on request only, and then whatever else the machine does."""
