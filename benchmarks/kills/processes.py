"""The processes of a robot whose parts are killed: its doubles, its guard, its run.

The doubles outlive what is killed and say what their outputs did.
"""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Final

from benchmarks.disturbance.ends import EndsError
from benchmarks.kills.machines import Machines
from benchmarks.kills.record import OutputRecord
from firmware_runtime.links.control import ask
from firmware_runtime.links.errors import ControlError
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

COMMAND: Final = (sys.executable, "-m", "firmware_runtime.cli")
LONGEST_S: Final = 60.0
LOOK_S: Final = 0.01
SPAN_S: Final = 4.0
"""How long a span without kills is, unless it is beside one with kills."""
LONGEST_SPAN_S: Final = 20.0
STRANGER_S: Final = 1.3
"""How long a process that has nothing to do with the robot lives, unless a round of kills says."""
_SETTINGS: Final = (
    "arming.max_late_percent=100",  # one that was hurt is to drive again soon
    "thrust_pairs.timeout_s=1",  # its own stop is not what is measured
    "imu.max_bias_rad_s=1000",  # it still turns from the round before
    "imu.still_rad_s=1000",
    "imu.calibration_s=0.05",
    "controller.compass_check.tolerance_rad=1000",
)


class Processes:
    """TachoBot on served doubles with its guard; everything ends with the stack.

    Its run, with its carrier, and its guard are on the robot's processors if `machines` says which.
    Waits end early, with EndsError, once `stopping` is set.
    """

    def __init__(
        self,
        stack: ExitStack,
        directory: Path,
        words: Sequence[str],
        stopping: Event,
        machines: Machines | None = None,
    ) -> None:
        self._machines = machines
        self.span_s, self.life_s = SPAN_S, STRANGER_S
        self.record = OutputRecord(directory / "doubles.log")
        self.statistics = directory / "tachobot.stats"
        self._stack, self._directory, self._stopping = stack, directory, stopping
        self._errors = stack.enter_context((directory / "errors.log").open("a"))
        chips = directory / "doubles.socket"
        log = directory / "doubles.log"
        served = self.start("doubles", "serve", "tachobot", "--socket", chips, "--log", log)
        self.wait_until(chips.exists, "the doubles are served")
        with suppress(PermissionError):  # chips answer whatever else the machine does
            os.sched_setscheduler(served.pid, os.SCHED_FIFO, os.sched_param(99))
        self._on_robot(self.start("guard", "tachobot", "--doubles", chips))
        settings = [word for each in _SETTINGS for word in ("--set", each)]
        self._words = ["tachobot", "--doubles", chips, "--supervised", "--for", "7200", *settings]
        self._words += words
        self.start_run_again()

    def start(self, *words: object, over: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
        """A command of the program; it does not outlive the stack."""
        return self.start_program([*COMMAND, *map(str, words)], over or {})

    def start_program(self, words: Sequence[str], over: Mapping[str, str]) -> subprocess.Popen[str]:
        """A program with the variables `over` those of this process."""
        own = {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(self._directory)}
        process = subprocess.Popen(
            words,
            env={**os.environ, **own, **over},
            stdin=subprocess.PIPE,
            stdout=self._errors,
            stderr=self._errors,
            text=True,
        )
        self._stack.callback(_end, process)
        return process

    def start_run_again(self) -> None:
        """A run, in the place of one that has ended."""
        self.run = self._on_robot(self.start("run", *self._words))

    def _on_robot(self, process: subprocess.Popen[str]) -> subprocess.Popen[str]:
        """A process that has just begun, on the robot's processors."""
        if self._machines is not None:
            self._machines.move_to_robot(process.pid)
        return process

    def arm(self) -> None:
        """Ask the run to drive."""
        with suppress(ControlError):  # it is not there yet, or has just ended
            ask(self.statistics, "arm")

    def disarm(self) -> None:
        """Switch its outputs off."""
        ask(self.statistics, "disarm")
        self.wait_until(lambda: not self.record.is_on, "all outputs are off")

    def read(self) -> Statistics:
        """The run's statistics by now."""
        return read_statistics(self.statistics)

    def last_like(self, span_s: float, kills: int) -> None:
        """From now on let spans without kills be as long, and strangers live as long as a part."""
        self.span_s = min(max(span_s, SPAN_S), LONGEST_SPAN_S)
        self.life_s = span_s / kills if kills > 0 else STRANGER_S

    def leave_alone(self) -> None:
        """Let a span pass."""
        self.pause(self.span_s)

    @property
    def elsewhere(self) -> dict[str, str]:
        """The variables of a process that has nothing to do with this robot."""
        return {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(self._directory / "stranger")}

    def start_stranger(self) -> subprocess.Popen[str]:
        """A process like the one that is killed, of no robot."""
        raise NotImplementedError

    def start_strangers(self) -> None:
        """Let a span pass, in which processes of no robot are started and killed one by one."""
        ends_at = monotonic() + self.span_s
        while monotonic() < ends_at:
            stranger = self.start_stranger()
            self.pause(self.life_s)
            stranger.kill()
            stranger.wait()

    def pause(self, span_s: float) -> None:
        """Let time pass. Raises EndsError where all is to end."""
        if self._stopping.wait(span_s):
            raise EndsError("interrupted")

    def wait_until(self, true: Callable[[], object], what: str) -> None:
        """Look again and again. Raises EndsError when it does not become true."""
        give_up_at = monotonic() + LONGEST_S
        while not true():
            if monotonic() > give_up_at:
                said = (self._directory / "errors.log").read_text().strip().splitlines()[-5:]
                raise EndsError(f"not within {LONGEST_S:g} s: {what}; {' / '.join(said)}")
            self.pause(LOOK_S)


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()
