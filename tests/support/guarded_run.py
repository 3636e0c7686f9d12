"""A guarded run on served doubles: three processes, and the time until all outputs were off."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from time import monotonic_ns
from typing import Any

from firmware_runtime.board.assignments import set_words
from firmware_runtime.links.control import ask
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.reader import read_statistics
from tests.support.waiting import PATIENCE_S, wait_until

__all__ = [
    "GuardedRun",
    "answer_like_chips",
    "guarded_run",
    "next_sentence",
    "unhurried",
    "wait_until",
]
COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
_LATE: Mapping[str, Sequence[str]] = {
    "tachobot": (
        "controller.compass_check.tolerance_rad=1000",
        "controller.compass_check.brief_tolerance_rad=1000",
    )
}
"""What of a robot's would end a run that was late: its compass seems to contradict its gyro."""
_STOPS: Mapping[str, Sequence[str]] = {"tachobot": ("world.yaw_damping_nms=0.2",)}
"""What lets a robot whose motors are off stand still within seconds, so that the next run can
measure its gyro's bias: without friction it would turn on for good."""


def unhurried(robot: str) -> list[str]:
    """Return words for a machine that other programs share: a late run is armed, and goes on."""
    return set_words(["arming.max_late_percent=100", *_LATE.get(robot, ())])


def next_sentence(guard: "subprocess.Popen[str]") -> str:
    """Return what a guard says next beside which run it watches."""
    assert guard.stdout is not None
    while "watching the run of process" in (line := guard.stdout.readline()):
        pass
    return line


class GuardedRun:
    """A robot on doubles that outlive it, watched by a guard where one is wanted."""

    def __init__(self, directory: Path, robot: str, seen_in: Path | None = None) -> None:
        self.robot = robot
        seen_in = seen_in or directory
        self.socket, self.log = directory / "doubles.socket", seen_in / "doubles.log"
        self.statistics = directory / f"{robot}.stats"
        self.environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(directory)}
        self.run: subprocess.Popen[str]
        self.guard: subprocess.Popen[str] | None = None
        self._errors = seen_in / "stderr.log"
        self._lines: list[dict[str, Any]] = []
        self._outputs: dict[str, float] = {}
        self._read_up_to = 0
        self.command: tuple[list[object], str] = ([], "")
        self._stack = ExitStack()

    def start(
        self,
        board: str,
        *,
        guard: bool,
        words: Sequence[str],
        program: str,
        environment: Mapping[str, str],
        supervised: bool,
    ) -> None:
        """Start the doubles, the guard and the run, and wait until it drives."""
        world = set_words(_STOPS.get(self.robot, ()))
        places = ("--socket", self.socket, "--log", self.log)
        chips = self._start("doubles", "serve", board, *places, *world)
        wait_until(self.socket.exists, "the doubles are served", self.errors)
        answer_like_chips(chips.pid)
        if guard:
            self.guard = self._start("guard", self.robot, "--doubles", self.socket)
            assert self.guard.stdout is not None
            assert "watching" in self.guard.stdout.readline()
        arguments: list[object] = [
            "run",
            board,
            "--doubles",
            self.socket,
            "--for",
            "600",
            "--json",
            *unhurried(self.robot),
            *words,
        ]
        arguments += ["--supervised", "--arm"] if supervised else []
        if not guard:
            arguments += ["--set", "arming.demand_guard=false"]
        self.environment |= environment
        self.command = arguments, program
        self.run_again()

    def run_again(self) -> None:
        """Start the run, as it was started before, and wait until it drives."""
        arguments, program = self.command
        self.run = self._start(*arguments, program=program)
        wait_until(self._is_driving, "the motors are driven", self._against_arming)

    def start_instead(self, *words: object, program: str) -> None:
        """Start another run in the place of one that has ended, and wait for nothing."""
        self.run = self._start(*words, program=program)

    def _start(self, *words: object, program: str = "") -> "subprocess.Popen[str]":
        command = [*COMMAND, *map(str, words)]
        if program:
            command = [sys.executable, "-c", program, *map(str, words)]
        with self._errors.open("a") as errors:
            process = subprocess.Popen(
                command,
                env=self.environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
                cwd=Path(__file__).parents[2],
            )
        self._stack.callback(process.communicate)
        self._stack.callback(process.kill)
        return process

    # What the doubles saw -------------------------------------------------------------------------

    def lines(self) -> list[dict[str, Any]]:
        """The log's whole lines; those that were read before are kept."""
        if self.log.exists():
            with self.log.open("rb") as file:
                file.seek(self._read_up_to)
                whole = file.read().rpartition(b"\n")[0]
            new = [json.loads(line) for line in whole.splitlines()]
            self._read_up_to += len(whole) + 1 if whole else 0
            self._lines += new
            self._outputs |= {line["output"]: line["value"] for line in new if "output" in line}
        return self._lines

    def outputs(self) -> dict[str, float]:
        """What each output that ever changed stands at."""
        self.lines()
        return self._outputs

    def _is_driving(self) -> bool:
        assert self.run.poll() is None, self._errors.read_text()
        return not self.is_off

    def _against_arming(self) -> str:
        """What speaks against arming right now, and what the processes said."""
        return f"{self.ask('arm', self.robot).stderr}{self.errors()}"

    @property
    def is_off(self) -> bool:
        """Whether every output is off, by the doubles."""
        return not any(self.outputs().values())

    def until_off_ms(self, since_ns: int) -> float:
        """How long after an instant (CLOCK_MONOTONIC) the last output went off."""
        wait_until(lambda: self.is_off, "all outputs are off", self.errors)
        lines = self.lines()
        last = max(line["t_ns"] for line in lines if "output" in line)
        took: float = (self._served_at() + last - since_ns) / 1e6
        return took

    def _served_at(self) -> int:
        at: int = next(
            line["monotonic_ns"] for line in self.lines() if line.get("event") == "serving"
        )
        return at

    def ask(self, *words: object) -> "subprocess.CompletedProcess[str]":
        """Another command, with the run's environment, until it ends."""
        return subprocess.run(
            [*COMMAND, *map(str, words)],
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )

    @contextmanager
    def another(self, *words: object, program: str = "") -> Iterator["subprocess.Popen[str]"]:
        """Another command, with the run's environment, within the block."""
        process = self._start(*words, program=program)
        try:
            yield process
        finally:
            process.kill()

    def arm_again(self) -> None:
        """Ask until nothing speaks against arming any more, and wait until it drives."""
        wait_until(self._arms, "it is armed again", self._against_arming)
        wait_until(lambda: not self.is_off, "the motors are driven again", self.errors)

    def _arms(self) -> bool:
        answer = ask(self.statistics, "arm")
        return bool(answer.get("armed"))

    def safe_state(self, reason: str) -> str:
        """What ExecStopPost runs; it must succeed."""
        words = (self.robot, "--doubles", self.socket, "--reason", reason)
        done = self.ask("safe-state", *words)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def takeovers(self) -> list[dict[str, Any]]:
        """What the guard noted."""
        path = self.statistics.with_suffix(".guard")
        return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []

    def steps(self) -> int:
        """How many steps the run has made."""
        steps: int = read_statistics(self.statistics).cells[STEPS]
        return steps

    def fault_ends_at(self) -> int:
        """The instant (CLOCK_MONOTONIC) at which the bus is free again."""
        fault = next(line for line in self.lines() if line.get("event") == "fault")
        ends_at: int = self._served_at() + fault["until_ns"]
        return ends_at

    # What is done to it ---------------------------------------------------------------------------

    def signal(self, number: signal.Signals) -> int:
        """Send the run a signal; return when that was."""
        at = monotonic_ns()
        self.run.send_signal(number)
        return at

    def errors(self) -> str:
        """What the processes wrote to standard error."""
        return self._errors.read_text()

    def close(self) -> None:
        self._stack.close()


def answer_like_chips(doubles: int) -> None:
    """Let a server of doubles answer whatever else runs, as chips do."""
    as_fifo(doubles, 99)


def as_fifo(process: int, priority: int) -> None:
    """Run a process before ordinary ones, as a unit does; needs permission to do so."""
    with suppress(PermissionError):
        os.sched_setscheduler(process, os.SCHED_FIFO, os.sched_param(priority))


@contextmanager
def guarded_run(
    directory: Path,
    *,
    robot: str = "tachobot",
    board: str = "",
    guard: bool = True,
    words: Sequence[str] = (),
    program: str = "",
    environment: Mapping[str, str] | None = None,
    supervised: bool = True,
    seen_in: Path | None = None,
) -> Iterator[GuardedRun]:
    """A run that drives its motors; everything is killed afterwards.

    `board` is another board file than the robot's own, `program` what to run instead of the
    command, `environment` what only the run has, `seen_in` where what is seen of it is kept, if not
    in its directory.
    """
    run = GuardedRun(directory, robot, seen_in)
    try:
        run.start(
            board or robot,
            guard=guard,
            words=words,
            program=program,
            environment=environment or {},
            supervised=supervised,
        )
        yield run
    finally:
        run.close()
