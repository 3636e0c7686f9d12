"""A robot in two processes, and each part of it killed.

doubles <--socket--> run --role robot <--UDP with a key--> run --role controller
   ^                 (its carrier)                          (its carrier)
   +--- guard
"""

import subprocess
from contextlib import ExitStack
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Final

from benchmarks.disturbance.ends import EndsError, free_port
from benchmarks.kills.killed import Killed, kill_now
from benchmarks.kills.machines import Machines
from benchmarks.kills.processes import LONGEST_S, Processes
from firmware_runtime.links.key_file import write_key

_ARMS_ITSELF_S: Final = 5.0
"""After a silence a robot is armed again by itself; to ask before that would wake its loop."""


class LinkedRobot(Processes):
    """Its controller is a process at the other end of a link over UDP.

    To be made, and its parts killed, on the processors of the others.
    """

    def __init__(
        self, stack: ExitStack, directory: Path, stopping: Event, machines: Machines
    ) -> None:
        key = directory / "link.key"
        write_key(key)
        self._link = ["--link", f"udp:127.0.0.1:{free_port()},key={key}"]
        self.machines = machines
        words = ["--role", "robot", *self._link, "--arm"]
        super().__init__(stack, directory, words, stopping, machines)
        self.start_controller()

    def start_controller(self) -> None:
        """A controller, in the place of one that has ended."""
        self.controller = self.start("run", "tachobot", "--role", "controller", *self._link)

    def wait_until_driving(self) -> None:
        """Raises EndsError if it never does."""
        asks_at = monotonic() + _ARMS_ITSELF_S
        self.wait_until(lambda: self._drives(asks_at), "the robot drives")

    def _drives(self, asks_at: float) -> bool:
        """It is armed again by itself; a guard that took over keeps it from that."""
        if not self.record.is_on and monotonic() >= asks_at and self.run.poll() is None:
            self.arm()
        return self.record.is_on

    def start_stranger(self) -> subprocess.Popen[str]:
        """A controller of no robot, with a key and a port of its own."""
        key = self._directory / "stranger.key"
        if not key.exists():
            write_key(key)
        link = f"udp:127.0.0.1:{free_port()},key={key}"
        words = ("run", "tachobot", "--role", "controller", "--link", link)
        return self.start(*words, over=self.elsewhere)

    def kill_controller(self) -> Killed:
        """And start another."""
        killed = kill_now(self.controller.pid)
        self.controller.wait()
        self.start_controller()
        return killed

    def kill_controller_s_carrier(self) -> Killed:
        """Its run ends of it; start another."""
        killed = kill_now(carrier_of(self.controller.pid))
        self.controller.wait(LONGEST_S)
        self.start_controller()
        return killed

    def kill_robot_s_carrier(self) -> Killed:
        """Its run ends of it, with its outputs off; start another."""
        killed = kill_now(carrier_of(self.run.pid))
        self.run.wait(LONGEST_S)
        self.start_run_again()
        return killed

    def kill_robot(self) -> Killed:
        """The guard switches its outputs off; start another."""
        killed = kill_now(self.run.pid)
        self.run.wait()
        self.start_run_again()
        return killed


def carrier_of(process: int) -> int:
    """The only child of a run. Raises EndsError unless it has one."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    if len(children) != 1:
        raise EndsError(f"process {process} has {len(children)} children, expected its carrier")
    return int(children[0])
