"""TachoBot on doubles and a bridge, each a process of its own, and UDP sockets to speak with it."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from select import select
from typing import Any

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.reader import read_statistics
from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


class Talker:
    """A UDP socket to the bridge; what it waits for must come within a bound."""

    def __init__(self, robot: tuple[Any, ...]) -> None:
        family = socket.AF_INET6 if ":" in robot[0] else socket.AF_INET
        self.socket = socket.socket(family, socket.SOCK_DGRAM)
        self.socket.settimeout(PATIENCE_S)
        self._robot = robot

    def say(self, what: object) -> None:
        self.socket.sendto(json.dumps(what).encode(), self._robot)

    def receive(self) -> dict[str, Any]:
        message: dict[str, Any] = json.loads(self.socket.recv(65536))
        return message

    def ask(self, what: object) -> dict[str, Any]:
        self.say(what)
        return self.receive()

    def insist(self, what: object, key: str) -> Any:  # noqa: ANN401 -- of any type, like the key
        """Ask until there is an answer with this key: one that found no room is lost."""
        for _ in range(PATIENCE_S):
            self.say(what)
            while select([self.socket], (), (), 1)[0]:
                if key in (message := self.receive()):
                    return message[key]
        raise AssertionError(f"no answer with {key!r}")


class Processes:
    """Starts commands of the program that share a directory; all are gone at the end."""

    command: Sequence[str] = COMMAND
    out: int | None = subprocess.PIPE

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        self.directory = directory
        self._stack = stack

    def start(
        self, *words: object, under: Sequence[str] = (), **environment: str
    ) -> "subprocess.Popen[bytes]":
        """A command, `under` another; both of its outputs are one."""
        return self.start_words([*under, *self.command, *map(str, words)], **environment)

    def start_words(self, words: Sequence[str], **environment: str) -> "subprocess.Popen[bytes]":
        """Any command."""
        process = subprocess.Popen(
            words,
            env={**self.environment, **environment},
            stdin=subprocess.DEVNULL,
            stdout=self.out,
            stderr=subprocess.STDOUT,
            bufsize=0,  # so that `select` sees all that has not been read
        )
        self._stack.callback(kill, process)
        return process

    @property
    def environment(self) -> dict[str, str]:
        """The variables of each."""
        return {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(self.directory)}


class BridgedRun(Processes):
    """A run and its bridges; `path` has the run's statistics."""

    def __init__(self, directory: Path, stack: ExitStack) -> None:
        super().__init__(directory, stack)
        self.path = directory / "tachobot.stats"

    def run(self, *words: str) -> "subprocess.Popen[bytes]":
        """A run on doubles, in real time, until it is stopped."""
        return self.start("run", "tachobot", "--doubles", "--for", "600", "--json", *words)

    def has_begun(self) -> bool:
        """Whether the run has made a step: then it answers."""
        try:
            return read_statistics(self.path).cells[STEPS] > 0
        except StatisticsFileError:
            return False

    def bridge(
        self, *words: str, listen: str = "127.0.0.1:0", **environment: str
    ) -> "subprocess.Popen[bytes]":
        """A bridge at a free port; it has not looked for a run yet."""
        return self.start("bridge", "tachobot", "--listen", listen, *words, **environment)

    def talker(self, robot: tuple[Any, ...]) -> Talker:
        talker = Talker(robot)
        self._stack.callback(talker.socket.close)
        return talker


def line(process: "subprocess.Popen[bytes]", end: str) -> str:
    """The next line that ends so, of what a process prints."""
    assert process.stdout is not None
    for _ in range(100):
        assert select([process.stdout], (), (), PATIENCE_S)[0], (
            f"not within {PATIENCE_S} s: {end!r}"
        )
        printed = process.stdout.readline().decode()
        assert printed, f"ended before {end!r}"
        if re.search(end, printed):
            return printed.strip()
    raise AssertionError(f"never printed: {end!r}")


def address(bridge: "subprocess.Popen[bytes]") -> tuple[str, int]:
    """Where the bridge says it listens."""
    host, _, port = line(bridge, "listening at").rpartition(" ")[2].rpartition(":")
    return host.strip("[]"), int(port)


def stop(process: "subprocess.Popen[bytes]", number: signal.Signals) -> tuple[int, str]:
    """Its status, and what it printed since it was read last."""
    process.send_signal(number)
    out, _ = process.communicate(timeout=PATIENCE_S)
    return process.returncode, out.decode()


def kill(process: "subprocess.Popen[bytes]") -> None:
    """Kill it, and close what it prints to."""
    process.kill()
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


@contextmanager
def bridged(directory: Path) -> Iterator[BridgedRun]:
    """Everything that is started within is gone afterwards."""
    with ExitStack() as stack:
        yield BridgedRun(directory, stack)
