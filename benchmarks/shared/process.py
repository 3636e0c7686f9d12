"""TachoBot on its doubles in a process of its own: the command as shipped, started, read, stopped.

What it does is read from its statistics file, by this process. Byte code is kept in a directory of
the bench's, so that a start is what a user of an installed package sees, whatever this process was
given options on byte code.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
LOOK_S = 0.005
LONGEST_S = 60.0
"""How long to wait for something that takes a second or two on a quiet machine."""


class LoopError(FirmwareRuntimeError):
    """The process did not do what it was started for."""


@dataclass(frozen=True, slots=True)
class Running:
    """A process that runs TachoBot."""

    process: "subprocess.Popen[str]"
    statistics: Path

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

    def _complaint(self) -> str:
        self.process.kill()
        complaint = self.process.communicate()[1].strip()
        return complaint or f"exit status {self.process.returncode}"


@contextmanager
def tachobot(directory: Path, seconds: float, assignments: Sequence[str] = ()) -> Iterator[Running]:
    """Run TachoBot for so long at most; its statistics are kept in the directory.

    The process does not outlive the block.
    """
    statistics = directory / "tachobot.stats"
    statistics.unlink(missing_ok=True)
    command = [*COMMAND, "run", "tachobot", "--doubles", "--for", str(seconds), "--json"]
    command += ["--statistics", str(statistics)]
    for assignment in assignments:
        command += ["--set", assignment]
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(directory / "byte-code")}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
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
            yield Running(process, statistics)
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()
