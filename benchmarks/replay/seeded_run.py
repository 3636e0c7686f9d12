"""One run by its seed, as a process, and what is done to it."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from random import Random
from time import monotonic, sleep
from typing import Any, Final

from benchmarks.shared.side_by_side import PROJECT
from firmware_runtime.board.assignments import set_words
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError
from firmware_runtime.links.control import ask
from firmware_runtime.links.ports.ports_client import PortsClient

SPAN_S: Final = 2.5
LONGEST_S: Final = 60.0
_SETTINGS: Final = ("arming.max_late_percent=100", "arming.demand_guard=false")
_RETUNED: Final = {
    "tachobot": ("controller.yaw.kp", (0.2, 1.5)),
    "detective": ("mission.timeout_s", (100.0, 200.0)),
}


class SeededRun:
    """A run in a folder of its own; `board` is what it runs."""

    def __init__(self, random: Random, seed: int, folder: Path) -> None:
        self.board = random.choice(("tachobot", "detective"))
        self._random = random
        self._seed = seed
        self._folder = folder
        self._statistics = folder / f"{self.board}.stats"
        self._is_served = random.random() < 0.3
        self._ends_by = random.choice(("kill", "SIGTERM", "time"))

    def carried_out(self, stack: ExitStack) -> dict[str, Any]:
        """Run it to its end; say how it was run and what was done to it."""
        process = self._started(stack)
        begun = self._wait_for(process)
        done = []
        times = sorted(self._random.uniform(0.2, SPAN_S) for _ in range(self._random.randint(2, 9)))
        for at in times:
            sleep(max(0.0, begun + at - monotonic()))
            act = self._random.choice(self._actions())
            if process.poll() is None:
                with suppress(FirmwareRuntimeError, OSError):
                    act(process)
                    done.append(act.__name__.strip("_"))
        if self._ends_by != "time" and process.poll() is None:
            process.send_signal(signal.SIGKILL if self._ends_by == "kill" else signal.SIGTERM)
        process.wait(LONGEST_S)
        done.append(f"ended by {self._ends_by}")
        return {"board": self.board, "served": self._is_served, "done": done}

    def _started(self, stack: ExitStack) -> "subprocess.Popen[bytes]":
        words = ["run", self.board, "--for", str(SPAN_S + 0.5), "--supervised", "--arm"]
        words += set_words(_SETTINGS)
        if not self._is_served:
            words += ["--doubles"]
            return self._process(stack, "benchmarks.replay.faulty_run", str(self._seed), *words)
        socket = self._folder / "doubles.socket"
        serve = ("doubles", "serve", self.board, "--socket", str(socket))
        self._process(stack, "firmware_runtime.cli", *serve)
        give_up_at = monotonic() + LONGEST_S
        while not socket.exists() and monotonic() < give_up_at:
            sleep(0.01)
        return self._process(stack, "firmware_runtime.cli", *words, "--doubles", str(socket))

    def _process(self, stack: ExitStack, module: str, *words: str) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen(
            [sys.executable, "-m", module, *words],
            cwd=PROJECT,  # where `benchmarks` is found, wherever the bench was started
            env={**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(self._folder)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        stack.callback(_end, process)
        return process

    def _wait_for(self, process: "subprocess.Popen[bytes]") -> float:
        """Wait until it can be spoken to, or has ended."""
        give_up_at = monotonic() + LONGEST_S
        while not self._statistics.exists() and process.poll() is None and monotonic() < give_up_at:
            sleep(0.01)
        return monotonic()

    # What is done -------------------------------------------------------------------------------

    def _actions(self) -> list[Callable[["subprocess.Popen[bytes]"], None]]:
        actions = [self._stall, self._stall, self._arm, self._disarm, self._retune, self._reload]
        if self.board == "tachobot":
            actions += [self._send, self._send]
        if self._is_served:
            actions += [self._fail, self._fail]
        return actions

    def _stall(self, process: "subprocess.Popen[bytes]") -> None:
        process.send_signal(signal.SIGSTOP)
        sleep(self._random.uniform(0.01, 0.15))
        process.send_signal(signal.SIGCONT)

    def _arm(self, _process: "subprocess.Popen[bytes]") -> None:
        self._ask("arm")

    def _disarm(self, _process: "subprocess.Popen[bytes]") -> None:
        self._ask("disarm")

    def _retune(self, _process: "subprocess.Popen[bytes]") -> None:
        key, span = _RETUNED[self.board]
        with suppress(ConfigError):
            self._ask("set", values={key: self._random.uniform(*span)})

    def _reload(self, process: "subprocess.Popen[bytes]") -> None:
        process.send_signal(signal.SIGHUP)

    def _send(self, _process: "subprocess.Popen[bytes]") -> None:
        client = PortsClient(self._statistics)
        try:
            client.put("yaw_reference", self._random.uniform(-0.5, 0.5))
        finally:
            client.close()

    def _fail(self, _process: "subprocess.Popen[bytes]") -> None:
        kind = self._random.choice(("nack", "arbitration", "fault"))
        words = ("doubles", "fault", kind, "--socket", str(self._folder / "doubles.socket"))
        command = [sys.executable, "-m", "firmware_runtime.cli", *words, "--for", "0.1"]
        subprocess.run(command, check=False, capture_output=True)

    def _ask(self, request: str, **more: Any) -> None:  # noqa: ANN401 -- what JSON has
        ask(self._statistics, request, **more)


def _end(process: "subprocess.Popen[bytes]") -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.kill()
    process.wait()
