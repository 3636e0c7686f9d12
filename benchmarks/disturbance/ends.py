"""Both ends of TachoBot as processes, over UDP with a key, on doubles."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.key_file import write_key
from firmware_runtime.statistics.errors import StatisticsFileError
from firmware_runtime.statistics.layout import ARMED
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
LONGEST_S = 60.0
LOOK_S = 0.02
HOST = "127.0.0.1"


class EndsError(FirmwareRuntimeError):
    """The ends did not do what they were started for."""


@dataclass(slots=True)
class Ends:
    """A robot's end that drives, and its controller's."""

    robot: "subprocess.Popen[str]"
    controller: "subprocess.Popen[str]"
    statistics: Path
    port: int
    start_controller: Callable[[], "subprocess.Popen[str]"]

    def kill_controller(self) -> None:
        """`kill -9` of the controller's end, and another in its place."""
        self.controller.kill()
        self.controller.wait()
        self.controller = self.start_controller()

    def read(self) -> Statistics:
        """The robot's statistics by now."""
        return read_statistics(self.statistics)

    @property
    def is_armed(self) -> bool:
        """Whether the robot drives."""
        try:
            return self.read().cells[ARMED] == 1
        except StatisticsFileError:
            return False

    def wait_until_armed(self) -> None:
        """Raises EndsError if it never is."""
        give_up_at = monotonic() + LONGEST_S
        while not self.is_armed:
            if monotonic() > give_up_at or self.robot.poll() is not None:
                raise EndsError(f"the robot did not get going: {_complaint(self.robot)}")
            sleep(LOOK_S)

    def ended(self) -> dict[str, Any]:
        """Stop the robot; what it prints at its end."""
        self.robot.terminate()
        printed, said = self.robot.communicate(timeout=LONGEST_S)
        if not printed:
            raise EndsError(f"the robot printed no report: {said.strip()}")
        report: dict[str, Any] = json.loads(printed)
        return report


@contextmanager
def both_ends(directory: Path) -> Iterator[Ends]:
    """Start both; they do not outlive the block."""
    key, port = directory / "link.key", free_port()
    if not key.exists():
        write_key(key)
    link = ["--link", f"udp:{HOST}:{port},key={key}"]
    with ExitStack() as stack:
        robot = _started(
            stack, directory, "--role", "robot", *link, "--doubles", "--for", "3600", "--json"
        )
        start = partial(_started, stack, directory, "--role", "controller", *link, "--json")
        yield Ends(robot, start(), directory / "tachobot.stats", port, start)


def free_port() -> int:
    """A port of UDP that is free at the moment."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HOST, 0))
        port: int = probe.getsockname()[1]
        return port


def _started(stack: ExitStack, directory: Path, *words: str) -> "subprocess.Popen[str]":
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(directory)}
    process = subprocess.Popen(
        [*COMMAND, "run", "tachobot", *words],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    stack.callback(process.communicate)
    stack.callback(process.kill)
    return process


def _complaint(process: "subprocess.Popen[str]") -> str:
    process.kill()
    return process.communicate()[1].strip() or f"exit status {process.returncode}"
