"""A robot in two processes, and each part of it killed.

doubles <--socket--> run --role robot <--UDP with a key--> run --role controller
   ^                 (its carrier)                          (its carrier)
   +--- guard
"""

import os
import signal
from contextlib import ExitStack
from pathlib import Path
from threading import Event

from benchmarks.disturbance.ends import EndsError, free_port
from benchmarks.kills.processes import LONGEST_S, Processes
from firmware_runtime.links.key_file import write_key


class LinkedRobot(Processes):
    """Its controller is a process at the other end of a link over UDP."""

    def __init__(self, stack: ExitStack, directory: Path, stopping: Event) -> None:
        key = directory / "link.key"
        write_key(key)
        self._link = ["--link", f"udp:127.0.0.1:{free_port()},key={key}"]
        super().__init__(stack, directory, ["--role", "robot", *self._link, "--arm"], stopping)
        self.start_controller()

    def start_controller(self) -> None:
        """A controller, in the place of one that has ended."""
        self.controller = self.start("run", "tachobot", "--role", "controller", *self._link)

    def wait_until_driving(self) -> None:
        """Raises EndsError if it never does."""
        self.wait_until(self._drives, "the robot drives")

    def _drives(self) -> bool:
        if self.run.poll() is None and not self.record.is_on:
            self.arm()
        return self.record.is_on

    def kill_controller(self) -> None:
        """And start another."""
        self.controller.kill()
        self.controller.wait()
        self.start_controller()

    def kill_controller_s_carrier(self) -> None:
        """Its run ends of it; start another."""
        os.kill(carrier_of(self.controller.pid), signal.SIGKILL)
        self.controller.wait(LONGEST_S)
        self.start_controller()

    def kill_robot_s_carrier(self) -> None:
        """Its run ends of it, with its outputs off; start another."""
        os.kill(carrier_of(self.run.pid), signal.SIGKILL)
        self.run.wait(LONGEST_S)
        self.start_run_again()

    def kill_robot(self) -> None:
        """The guard switches its outputs off; start another."""
        self.run.kill()
        self.run.wait()
        self.start_run_again()


def carrier_of(process: int) -> int:
    """The only child of a run. Raises EndsError unless it has one."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    if len(children) != 1:
        raise EndsError(f"process {process} has {len(children)} children, expected its carrier")
    return int(children[0])
