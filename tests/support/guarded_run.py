"""A guarded run on served doubles: three processes, and the time until all outputs were off."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from select import select
from time import monotonic_ns
from typing import Any

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
PATIENCE_NS = 30_000_000_000
LOOK_S = 0.005


def wait_until(true: Callable[[], bool], what: str) -> None:
    """Look again and again; the time between is spent in select, as the tool of last resort."""
    give_up_at = monotonic_ns() + PATIENCE_NS
    while not true():
        assert monotonic_ns() < give_up_at, f"not within 30 s: {what}"
        select((), (), (), LOOK_S)


class GuardedRun:
    """TachoBot on doubles that outlive it, watched by a guard where one is wanted."""

    def __init__(self, directory: Path) -> None:
        self.socket, self.log = directory / "doubles.socket", directory / "doubles.log"
        self.environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(directory)}
        self.run: subprocess.Popen[str]
        self.guard: subprocess.Popen[str] | None = None
        self._errors = directory / "stderr.log"
        self._stack = ExitStack()

    def start(self, board: str, *, guard: bool, words: Sequence[str], program: str) -> None:
        """Start the doubles, the guard and the run, and wait until it drives."""
        self._start("doubles", "serve", "tachobot", "--socket", self.socket, "--log", self.log)
        wait_until(self.socket.exists, "the doubles are served")
        if guard:
            self.guard = self._start("guard", "tachobot", "--doubles", self.socket)
            assert self.guard.stdout is not None
            assert "watching" in self.guard.stdout.readline()
        arguments = ["run", board, "--doubles", self.socket, "--supervised", "--arm"]
        arguments += ["--for", "600", "--json", *words]
        if not guard:
            arguments += ["--set", "arming.demand_guard=false"]
        self.run = self._start(*arguments, program=program)
        wait_until(self._is_driving, "the propellers are driven")

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
        """The log's whole lines."""
        if not self.log.exists():
            return []
        return [
            json.loads(line)
            for line in self.log.read_text().splitlines(keepends=True)
            if line.endswith("\n")
        ]

    def outputs(self) -> dict[str, float]:
        """What each output that ever changed stands at."""
        return {line["output"]: line["value"] for line in self.lines() if "output" in line}

    def _is_driving(self) -> bool:
        assert self.run.poll() is None, self._errors.read_text()
        return any(value > 0 for value in self.outputs().values())

    @property
    def is_off(self) -> bool:
        """Whether every output is off, by the doubles."""
        return not any(self.outputs().values())

    def until_off_ms(self, since_ns: int) -> float:
        """How long after an instant (CLOCK_MONOTONIC) the last output went off."""
        wait_until(lambda: self.is_off, "all outputs are off")
        lines = self.lines()
        epoch = next(line["monotonic_ns"] for line in lines if line.get("event") == "serving")
        last = max(line["t_ns"] for line in lines if "output" in line)
        took: float = (epoch + last - since_ns) / 1e6
        return took

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


@contextmanager
def guarded_run(
    directory: Path,
    *,
    board: str = "tachobot",
    guard: bool = True,
    words: Sequence[str] = (),
    program: str = "",
) -> Iterator[GuardedRun]:
    """A run whose propellers turn; everything is killed afterwards."""
    run = GuardedRun(directory)
    try:
        run.start(board, guard=guard, words=words, program=program)
        yield run
    finally:
        run.close()
