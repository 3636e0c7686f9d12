"""TachoBot on its doubles in a process of its own: the command as shipped, started, read, stopped.

What it does is read from its statistics file, by this process. Byte code is kept in a directory of
the bench's, so that a start is what a user of an installed package sees, whatever this process was
given options on byte code.
"""

import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, monotonic_ns, sleep

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
MADE = ("--doubles",)
"""Doubles made for the run; with a path, those that are served there."""
LOOK_S = 0.005
LONGEST_S = 60.0
"""How long to wait for something that takes a second or two on a quiet machine."""


class LoopError(FirmwareRuntimeError):
    """The process did not do what it was started for."""


@dataclass(frozen=True, slots=True)
class Running:
    """A process that runs TachoBot, started at `spawned_at` (CLOCK_MONOTONIC, ns)."""

    process: "subprocess.Popen[str]"
    statistics: Path
    spawned_at: int

    def read_when(self, ready: Callable[[Statistics], bool]) -> Statistics:
        """The first statistics that are as wanted. Raises LoopError when they do not come."""
        give_up_at = monotonic() + LONGEST_S
        while monotonic() < give_up_at and self.process.poll() is None:
            if self.statistics.exists():
                statistics = read_statistics(self.statistics)
                if ready(statistics):
                    return statistics
            sleep(LOOK_S)
        raise LoopError(f"tachobot did not get going: {self._complaint()}")

    def finished(self) -> Statistics:
        """The statistics after the end of the run. Raises LoopError unless it went well."""
        complaint = self.process.communicate()[1].strip()
        if self.process.returncode != 0:
            raise LoopError(f"tachobot failed: {complaint}")
        return read_statistics(self.statistics)

    def status_kib(self, name: str) -> int:
        """A size from /proc/PID/status, such as VmRSS, in KiB."""
        text = Path(f"/proc/{self.process.pid}/status").read_text()
        found = re.search(rf"^{name}:\s+(\d+)", text, re.MULTILINE)
        if found is None:
            raise LoopError(f"/proc/{self.process.pid}/status has no {name}")
        return int(found[1])

    def _complaint(self) -> str:
        self.process.kill()
        complaint = self.process.communicate()[1].strip()
        return complaint or f"exit status {self.process.returncode}"


@contextmanager
def tachobot(
    directory: Path, seconds: float, assignments: Sequence[str] = (), doubles: Sequence[str] = MADE
) -> Iterator[Running]:
    """Run TachoBot for so long at most; its statistics are kept in the directory."""
    statistics = directory / "tachobot.stats"
    statistics.unlink(missing_ok=True)
    command = [*COMMAND, "run", "tachobot", *doubles, "--for", str(seconds), "--json"]
    command += ["--statistics", str(statistics)]
    for assignment in assignments:
        command += ["--set", assignment]
    with _process(directory, command) as (process, spawned_at):
        yield Running(process, statistics, spawned_at)


@contextmanager
def served_doubles(directory: Path) -> Iterator[tuple[str, ...]]:
    """Doubles in a process of their own; yields the options that make a run drive them."""
    socket = str(directory / "doubles.socket")
    with _process(directory, [*COMMAND, "doubles", "serve", "tachobot", "--socket", socket]) as (
        process,
        _,
    ):
        assert process.stdout is not None  # noqa: S101 -- a pipe was asked for
        if not process.stdout.readline().startswith("serving"):
            raise LoopError(f"doubles were not served: {process.communicate()[1].strip()}")
        yield ("--doubles", socket)


def seconds_of_python(directory: Path, statement: str) -> float:
    """From its start to its end: the time a bare interpreter takes to carry out a statement."""
    code = f"{statement}; import time; print(time.monotonic_ns())"
    with _process(directory, [sys.executable, "-c", code]) as (process, spawned_at):
        ended = process.communicate(timeout=LONGEST_S)[0]
        return (int(ended) - spawned_at) / 1e9


def status_of_python(directory: Path, statement: str, name: str) -> int:
    """A size from /proc/PID/status of a bare interpreter that has carried out a statement, KiB."""
    code = f"{statement}; print(flush=True); input()"
    with _process(directory, [sys.executable, "-c", code]) as (process, spawned_at):
        assert process.stdout is not None  # noqa: S101 -- a pipe was asked for
        process.stdout.readline()
        return Running(process, Path(), spawned_at).status_kib(name)


def make_byte_code(directory: Path) -> None:
    """Start once what is going to be measured, so that no start or size includes compiling it."""
    seconds_of_python(directory, "import numpy")
    with (
        served_doubles(directory) as doubles,
        tachobot(directory, LONGEST_S, doubles=doubles) as running,
    ):
        running.read_when(lambda statistics: statistics.cells[STEPS] > 0)


@contextmanager
def _process(
    directory: Path, command: Sequence[str]
) -> Iterator[tuple["subprocess.Popen[str]", int]]:
    """A process and when it was started; it does not outlive the block."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(directory / "byte-code")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    spawned_at = monotonic_ns()
    process = subprocess.Popen(
        command,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    with process:
        try:
            yield process, spawned_at
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()
