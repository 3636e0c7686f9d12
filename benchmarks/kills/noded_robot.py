"""A robot that a ROS 2 node arms on a lease, and the node killed.

doubles <--socket--> run <--control socket--> node <--service `arm`-- one that asks again
   +--- guard
"""

import subprocess
from contextlib import ExitStack
from pathlib import Path
from threading import Event
from time import monotonic_ns
from typing import Final

from benchmarks.disturbance.ends import EndsError
from benchmarks.kills.killed import Killed, kill_now
from benchmarks.kills.processes import LONGEST_S, Processes
from firmware_runtime.links.ros2.interpreter import command_of, find_environment, variables_of

_ROOT: Final = Path(__file__).parents[2]
_OTHER_DOMAIN: Final = "77"
_THIS_MACHINE: Final = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


class NodedRobot(Processes):
    """Its whole model is in one run; a node arms it. Raises ConfigError without a ROS venv."""

    def __init__(self, stack: ExitStack, directory: Path, stopping: Event) -> None:
        environment = find_environment(None)
        super().__init__(stack, directory, [], stopping)
        self._wishes = directory / "wishes"
        self.node: subprocess.Popen[str] | None = None
        variables = variables_of(environment, {**_THIS_MACHINE, "PYTHONPATH": str(_ROOT)})
        words = command_of(environment, ["-m", "benchmarks.kills.arm_again", str(self._wishes)])
        self.start_program(words, {**variables, "ROS_LOG_DIR": str(directory)})

    def start_node(self) -> None:
        """A node, in the place of one that has ended."""
        log = {"ROS_LOG_DIR": str(self._directory)}
        self.node = self.start("ros2", "tachobot", "--autostart", over={**_THIS_MACHINE, **log})

    def kill_node(self) -> Killed:
        """And start another."""
        if self.node is None:
            raise EndsError("there is no node to be killed")
        killed = kill_now(self.node.pid)
        self.node.wait()
        self.start_node()
        return killed

    def start_stranger(self) -> subprocess.Popen[str]:
        """A node of no robot, in another ROS domain."""
        log = {"ROS_LOG_DIR": str(self._directory), "ROS_DOMAIN_ID": _OTHER_DOMAIN}
        over = {**_THIS_MACHINE, **log, **self.elsewhere}
        return self.start("ros2", "tachobot", "--autostart", over=over)

    def wait_until_driving(self) -> None:
        """The node arms it if need be; raises EndsError if it never does."""
        if self.node is None:
            if self.record.is_on:
                self.disarm()
            self.start_node()
        if not self.record.is_on:
            self._wishes.write_text(str(monotonic_ns()))
        self.wait_until(lambda: self.record.is_on, "the node has armed the robot")

    def drive_without_node(self) -> None:
        """End the node in order, which disarms; arm by the control socket. Raises EndsError."""
        if self.node is not None:
            self.node.terminate()
            self.node.wait(LONGEST_S)
            self.node = None
        self.wait_until(self._is_armed_by_request, "the robot drives")

    def _is_armed_by_request(self) -> bool:
        if not self.record.is_on:
            self.arm()
        return self.record.is_on
