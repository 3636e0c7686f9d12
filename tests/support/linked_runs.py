"""The two ends of a board on doubles, each a process of its own, and the link between them."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import cycle, islice
from pathlib import Path
from typing import Any

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.layout import ARMED, ELAPSED, STEPS
from firmware_runtime.statistics.reader import read_statistics
from tests.support.waiting import PATIENCE_S, wait_until

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
PORTS_OF_A_PROCESS = 500
_FIRST = 20_000 + os.getpid() % 24 * PORTS_OF_A_PROCESS
_ports = cycle(range(_FIRST, _FIRST + PORTS_OF_A_PROCESS))


class RunningEnd:
    """One end, as a process."""

    def __init__(self, words: list[str], directory: Path, name: str) -> None:
        self.statistics = directory / f"{name}.stats"
        environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(directory)}
        self.process = subprocess.Popen(
            [*COMMAND, "run", *words, "--json"],
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def report(self) -> dict[str, Any]:
        """What it prints at its end, which must come."""
        out, said = self.process.communicate(timeout=PATIENCE_S)
        assert out, said.decode()
        found: dict[str, Any] = json.loads(out)
        return {**found, "said": said.decode(), "status": self.process.returncode}

    def cell(self, index: int) -> int:
        """A cell of its statistics; 0 before it runs, and once its process has gone."""
        try:
            statistics = read_statistics(self.statistics)
        except StatisticsFileError:
            return 0
        is_own = statistics.header.writer.pid == self.process.pid
        return statistics.cells[index] if is_own and statistics.writer_alive else 0

    @property
    def is_armed(self) -> bool:
        """Whether it may drive its outputs, by its statistics."""
        return self.cell(ARMED) == 1

    def wait_until_it_has_run(self, elapsed: int) -> None:
        wait_until(lambda: self.cell(ELAPSED) >= elapsed, f"{elapsed} ns of its run")

    def wait_until_it_has_made(self, steps: int) -> None:
        wait_until(lambda: self.cell(STEPS) >= steps, f"{steps} steps of its run")

    def wait_until_armed(self, *, armed: bool = True) -> None:
        wait_until(lambda: self.is_armed is armed, "armed" if armed else "disarmed")

    def kill(self) -> None:
        """As `kill -9` does."""
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        self.kill()
        for pipe in (self.process.stdout, self.process.stderr):
            assert pipe is not None
            pipe.close()


class LinkedRuns:
    """Starts ends of a board; `link` is what both are given by `--link`."""

    def __init__(self, directory: Path, board: str, link: str, stack: ExitStack) -> None:
        self._directory = directory
        self._board = board
        self._link = link
        self._stack = stack
        self._name = Path(board).parent.name if board.endswith(".toml") else board

    def robot(self, *words: str) -> RunningEnd:
        """The end with the hardware, on doubles of its own."""
        return self._end("robot", self._name, "--doubles", *words)

    def controller(self, *words: str) -> RunningEnd:
        return self._end("controller", f"{self._name}.controller", *words)

    def _end(self, role: str, name: str, *words: str) -> RunningEnd:
        options = [self._board, "--role", role, "--link", self._link, *words]
        end = RunningEnd(options, self._directory, name)
        self._stack.callback(end.close)
        return end


def free_port() -> int:
    """A UDP port of the loopback that no program has, and that stays free until it is bound.

    It is below those that the kernel chooses, and every process of tests has a range of its own.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for port in islice(_ports, PORTS_OF_A_PROCESS):
            with suppress(OSError):  # another program's
                probe.bind(("127.0.0.1", port))
                return port
    raise AssertionError("no UDP port is free")


@contextmanager
def linked(directory: Path, board: str, link: str) -> Iterator[LinkedRuns]:
    """Everything that is started within is gone afterwards."""
    with ExitStack() as stack:
        yield LinkedRuns(directory, board, link, stack)
